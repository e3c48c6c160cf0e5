"""Crash tests and crash pulses held against the model."""
