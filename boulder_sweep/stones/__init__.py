"""Stones as they are: a scan of a rock becomes a solid, a way to stand, and a profile for the model."""
