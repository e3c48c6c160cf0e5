"""Commands of ``sweep`` beside the main job, one module each. They import heavy modules inside, as `cli` does."""

from boulder_sweep.subcommands.explain import explain
from boulder_sweep.subcommands.fit_vehicle import fit_vehicle
from boulder_sweep.subcommands.plot import plot
from boulder_sweep.subcommands.tradeoff import tradeoff
from boulder_sweep.subcommands.validate import validate

COMMANDS = (plot, explain, tradeoff, validate, fit_vehicle)
"""In the order of ``sweep --help``."""
