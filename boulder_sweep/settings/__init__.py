"""The file of settings: YAML with positions, units, typed values, every check."""

from boulder_sweep.settings.loader import load, load_text
from boulder_sweep.settings.model import Criterion, Model, ReadingChoice, SolverSettings
from boulder_sweep.settings.problems import Problem, SettingsError
from boulder_sweep.settings.sweep import Axis, Sweep

__all__ = [
    "Axis",
    "Criterion",
    "Model",
    "Problem",
    "ReadingChoice",
    "SettingsError",
    "SolverSettings",
    "Sweep",
    "load",
    "load_text",
]
