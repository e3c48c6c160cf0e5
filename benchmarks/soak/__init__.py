"""Kills, lost and stopped workers by the hundred, and what became of the tables: ``python -m benchmarks.soak``."""
