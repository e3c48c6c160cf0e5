"""Studies whose results stand in the documentation. ``python -m docs.studies`` repeats them all."""
