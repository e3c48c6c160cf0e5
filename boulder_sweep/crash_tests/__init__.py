"""Crash tests and crash pulses compared with the model."""
