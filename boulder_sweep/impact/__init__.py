"""One design over time."""
