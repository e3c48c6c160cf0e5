"""Studies whose results stand in the documentation. ``python -m boulder_sweep.studies`` repeats them all."""
