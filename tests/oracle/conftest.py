"""Impacts of the oracle that these tests compare with must be in its record."""

from tests.oracle.records import every_impact_is_recorded

__all__ = ["every_impact_is_recorded"]
