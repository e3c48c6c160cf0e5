"""A block of designs becomes judged rows: simulation, accuracy, verdict."""
