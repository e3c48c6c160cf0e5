"""Answers to an engineer's questions: how deep, how heavy, how sure, and what decides."""
