"""One self-contained page that carries the simulator: a report of a result, or an explorer of one design."""

from boulder_sweep.report.writing import checked_page, example, write_explorer, write_report

__all__ = ["checked_page", "example", "write_explorer", "write_report"]
