"""Tests of the compiled kernels, most of them against the reference implementation in tests.oracle.

Every test of this folder also runs with compilation switched off, but for those marked ``compiled``, which look at the
compiled code itself. Coverage of the kernels is measured so, because compiled code leaves no trace of its lines:

    NUMBA_DISABLE_JIT=1 pytest tests/kernels -m "not compiled and not nightly" --cov=boulder_kernels
"""
