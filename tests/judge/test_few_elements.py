"""What few soil elements cost is measured on the file's own designs."""

from __future__ import annotations

from pathlib import Path

import pytest

from boulder_sweep import simulate
from boulder_sweep.judge.few_elements import DESIGNS, words_of_few_elements
from boulder_sweep.settings import load

CONFIGS = Path(__file__).parents[2] / "configs"


def rwg(*overrides):
    return load(CONFIGS / "rwg.yaml", overrides)


@pytest.mark.parametrize(
    ("overrides", "few"),
    [
        ((), False),
        (("model.soil.elements=1",), True),
        (("model.soil.elements=199",), True),
        (("model.soil.elements=200",), False),
    ],
)
def test_below_200_elements_are_few(overrides, few):
    assert rwg(*overrides).model.has_few_elements == few


def test_one_element_fails_what_passes_in_closed_form():
    """The words hold the difference that two simulations of the design show."""
    one, closed = simulate(rwg("model.soil.elements=1")), simulate(rwg())
    assert (one.verdict, closed.verdict) == ("fail", "pass")
    off = 20.0 - closed.summary()["max_rotation_deg"]  # a table ends a row at its limit of rotation
    words = words_of_few_elements(rwg("model.soil.elements=1"))
    assert words == (
        "1 soil element against the closed form: another verdict for 1 of 1 design of this file, the rotation off by "
        f"up to {off:.2g} deg; take 200 or more, or closed_form"
    )


def test_the_difference_falls_with_the_number():
    def off(count):
        return float(words_of_few_elements(rwg(f"model.soil.elements={count}")).split(" up to ")[1].split()[0])

    assert 6.0 < off(1) < 7.0
    assert 0.0 < off(100) < 0.01 < off(10) < 1.0


def test_designs_that_cannot_be_computed_are_left_out():
    words = words_of_few_elements(rwg("site.embedment_depth=[2 m, 4 m]", "model.soil.elements=1"))
    assert "1 of 1 design" in words
    assert " 0 of 0 designs " in words_of_few_elements(rwg("site.embedment_depth=[4 m, 5 m]", "model.soil.elements=1"))


def test_a_grid_is_sampled():
    words = words_of_few_elements(load(CONFIGS / "m30_sizing.yaml", ["model.soil.elements=1"]))
    changed, of, sample = words.partition("verdict for ")[2].split()[:3]
    assert of == "of"
    assert 0 < int(changed) < int(sample) <= DESIGNS
