"""What pictures say of the soil, in the units of the reader."""

import pytest

from boulder_sweep.settings.model import Ground
from boulder_sweep.views.wording import ground_words


@pytest.mark.parametrize(
    ("units", "words"),
    [("si", "cohesion 5 kPa, water table 0.9144 m down"), ("us", "cohesion 104.4 psf, water table 3 ft down")],
)
def test_the_ground_is_in_the_units_of_the_picture(units: str, words: str) -> None:
    settings = {"model": {"ground": Ground(cohesion_kPa=5.0, water_table_m=0.9144).as_dict()}}
    assert ground_words(settings, units) == words
