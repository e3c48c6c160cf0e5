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
    from boulder_sweep.answers.need import Need as Need
    from boulder_sweep.answers.need import need as need
    from boulder_sweep.answers.reserves import Reserves as Reserves
    from boulder_sweep.answers.reserves import capacity as capacity
    from boulder_sweep.answers.uncertainty import Uncertainty as Uncertainty
    from boulder_sweep.answers.uncertainty import uncertainty as uncertainty
    from boulder_sweep.impact.simulation import Trajectory as Trajectory
    from boulder_sweep.impact.simulation import simulate as simulate
    from boulder_sweep.judge.quantiles import at_values as at_values
    from boulder_sweep.report.comparison import compare as compare
    from boulder_sweep.report.export import export as export
    from boulder_sweep.report.writing import write_explorer as write_explorer
    from boulder_sweep.report.writing import write_report as write_report
    from boulder_sweep.runner.run import Summary as Summary
    from boulder_sweep.runner.run import run as run
    from boulder_sweep.settings import SettingsError as SettingsError
    from boulder_sweep.settings import Sweep as Sweep
    from boulder_sweep.settings import load as load
    from boulder_sweep.store import read as read

    __version__: str

# Names are fetched at first use: the import of numba or pandas takes longer than checking a file.
_PUBLIC = {
    "boulder_sweep.answers.need": ("Need", "need"),
    "boulder_sweep.answers.reserves": ("Reserves", "capacity"),
    "boulder_sweep.answers.uncertainty": ("Uncertainty", "uncertainty"),
    "boulder_sweep.impact.simulation": ("Trajectory", "simulate"),
    "boulder_sweep.judge.quantiles": ("at_values",),
    "boulder_sweep.report.comparison": ("compare",),
    "boulder_sweep.report.export": ("export",),
    "boulder_sweep.report.writing": ("write_explorer", "write_report"),
    "boulder_sweep.runner.run": ("Summary", "run"),
    "boulder_sweep.settings": ("SettingsError", "Sweep", "load"),
    "boulder_sweep.store": ("read",),
}
"""Public names by the module they live in; type checkers read them above."""
_HOME = {name: module for module, names in _PUBLIC.items() for name in names}
__all__ = sorted([*_HOME, "__version__"])


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
