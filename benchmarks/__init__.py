"""Benchmarks of boulder-sweep: how fast, how accurate, beside what else, and a gate that keeps it so.

``python -m benchmarks`` runs them all and writes the tables of ``benchmarks/README.md``; ``python -m benchmarks.NAME``
runs one of `kernel`, `accuracy`, `sweep`, `peers` and `gate`.
"""
