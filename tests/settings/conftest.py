from collections.abc import Callable
from pathlib import Path

import pytest

from boulder_sweep.settings import Problem, SettingsError, Sweep, load_text

# The form in which the format is described to users.
EXAMPLE = "\n".join(
    (
        "name: m30-sizing",
        "boulder:  {length: 1.65 m, width: 1.68 m, height: {from: 1.6 m, to: 3.4 m, count: 19}, density: 2596 kg/m^3}",
        "site:     {embedment_ratio: {from: 0.40, to: 0.70, step: 0.02}}      # or embedment_depth: 2.03 m",
        "soil:     {density: 1859.9 kg/m^3, friction_angle: [36, 40, 43.2] deg, "
        "subgrade_reaction: [25, 60, 95] MN/m^3, strain_rate_factor: 1.0}",
        "vehicle:  {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m, "
        "bumper_height: 0.5 m, hood_height: 1.4 m, bed_offset: 2.9 m}",
        "criterion: {max_rotation: 20 deg, rating: P1}",
        "model:    {readings: corrected, soil: closed_form}    # as_printed | {preset: corrected, inertia: printed}",
        "solver:   {accuracy: balanced, horizon: 1 s}           # or step: 4 ms",
        "",
    )
)

# One design, nothing optional, one entry a line.
MINIMAL = """\
boulder:
  length: 1.65
  width: 1.68
  height: 3.44
  density: 2596
site:
  embedment_depth: 2.03
soil:
  density: 1859.9
  friction_angle: 43.2
  subgrade_reaction: 95
vehicle:
  mass: 6722
  speed: 14.5
  spring: 3103.3e3
  damper: 138.91e3
"""


@pytest.fixture
def example() -> str:
    return EXAMPLE


@pytest.fixture
def minimal() -> str:
    return MINIMAL


def _load(text: str, *overrides: str) -> Sweep:
    return load_text(text, Path("grid.yaml"), overrides)


@pytest.fixture
def load_it() -> Callable[..., Sweep]:
    return _load


@pytest.fixture
def load_with() -> Callable[..., Sweep]:
    """Load the minimal file with entries replaced."""
    return lambda *overrides: _load(MINIMAL, *overrides)


@pytest.fixture
def problems_of() -> Callable[..., list[Problem]]:
    """Return the problems of a text that must have some."""

    def problems(text: str, *overrides: str) -> list[Problem]:
        with pytest.raises(SettingsError) as caught:
            _load(text, *overrides)
        assert caught.value.problems
        return caught.value.problems

    return problems


@pytest.fixture
def the_problem(problems_of) -> Callable[[str], Problem]:
    """Replace one entry of the minimal file and return the one problem this makes."""

    def problem(override: str) -> Problem:
        (only,) = problems_of(MINIMAL, override)
        return only

    return problem
