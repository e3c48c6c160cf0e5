"""Benchmarks of boulder-sweep: speed, accuracy, comparison with other solvers, and a gate against regressions."""
