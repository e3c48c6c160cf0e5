"""Which boulder, buried how deep in which soil, stops a truck: pass/fail tables over large grids of designs.

Examples
--------
>>> import boulder_sweep
>>> sweep = boulder_sweep.load("configs/m30_sizing.yaml")   # doctest: +SKIP
>>> summary = boulder_sweep.run(sweep, "m30.sweep")         # doctest: +SKIP
>>> table = boulder_sweep.read("m30.sweep")                 # doctest: +SKIP
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from boulder_sweep.answers.need import Need, need
    from boulder_sweep.answers.uncertainty import Uncertainty, uncertainty
    from boulder_sweep.impact.simulation import Trajectory, simulate
    from boulder_sweep.report.comparison import compare
    from boulder_sweep.report.export import export
    from boulder_sweep.report.writing import write_explorer, write_report
    from boulder_sweep.runner.sweeper import Summary, run
    from boulder_sweep.settings import SettingsError, Sweep, load
    from boulder_sweep.store import read

    __version__: str

__all__ = [
    "Need",
    "SettingsError",
    "Summary",
    "Sweep",
    "Trajectory",
    "Uncertainty",
    "__version__",
    "compare",
    "export",
    "load",
    "need",
    "read",
    "run",
    "simulate",
    "uncertainty",
    "write_explorer",
    "write_report",
]

# Names are fetched at first use: the import of numba or pandas takes longer than checking a file.
_HOME = {
    "Need": "boulder_sweep.answers.need",
    "need": "boulder_sweep.answers.need",
    "Uncertainty": "boulder_sweep.answers.uncertainty",
    "uncertainty": "boulder_sweep.answers.uncertainty",
    "SettingsError": "boulder_sweep.settings",
    "Sweep": "boulder_sweep.settings",
    "load": "boulder_sweep.settings",
    "Summary": "boulder_sweep.runner.sweeper",
    "run": "boulder_sweep.runner.sweeper",
    "Trajectory": "boulder_sweep.impact.simulation",
    "simulate": "boulder_sweep.impact.simulation",
    "read": "boulder_sweep.store",
    "compare": "boulder_sweep.report.comparison",
    "export": "boulder_sweep.report.export",
    "write_explorer": "boulder_sweep.report.writing",
    "write_report": "boulder_sweep.report.writing",
}


def __getattr__(name: str) -> Any:
    """Fetch a public name from the module it lives in."""
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("boulder-sweep")
    elif name in _HOME:
        from importlib import import_module

        value = getattr(import_module(_HOME[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)
