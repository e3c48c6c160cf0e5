"""Benchmarks of boulder-sweep: speed, accuracy, comparison with other solvers, and a gate against regressions.

``python -m benchmarks`` runs them all and writes the tables of ``benchmarks/README.md``; ``python -m benchmarks.NAME``
runs one of `kernel`, `accuracy`, `sweep`, `peers` and `gate`.
"""
