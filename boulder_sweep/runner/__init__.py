"""A whole sweep: blocks on workers, results in order, interruption and resume."""
