"""The file of settings: YAML with positions, units, typed values, every check."""

from boulder_sweep.settings.loader import load, load_text
from boulder_sweep.settings.problems import Problem, SettingsError
from boulder_sweep.settings.sweep import Sweep

__all__ = ["Problem", "SettingsError", "Sweep", "load", "load_text"]
