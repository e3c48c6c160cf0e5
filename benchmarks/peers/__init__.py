"""Other solvers on the same impacts, at the same accuracy, timed in the same process as the kernels."""
