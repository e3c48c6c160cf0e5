"""An entry by its path, its key or its column; what is no entry gets the nearest one."""

import pytest

from boulder_sweep.settings.fields import BOULDER_MASS, FIELDS, INPUTS, UnknownNameError, named

EVERY = (*FIELDS, BOULDER_MASS)


@pytest.mark.parametrize("field", INPUTS, ids=lambda field: field.path)
def test_every_input_has_three_names(field):
    assert named(field.path) is field
    assert named(field.name) is field
    keys = [one.key for one in (*INPUTS, BOULDER_MASS)]
    if keys.count(field.key) == 1:
        assert named(field.key) is field is named(field.key, EVERY)
    else:
        with pytest.raises(UnknownNameError, match=rf"'{field.key}' is ambiguous; use .*{field.path}"):
            named(field.key)


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("boulder.widht", "'boulder.widht' is not an input; did you mean boulder.width?"),
        ("widht", "'widht' is not an input; did you mean width?"),
        ("boulder_widht_m", "'boulder_widht_m' is not an input; did you mean boulder_width_m?"),
        ("Width", "'Width' is not an input; did you mean width?"),
        ("phi", "'phi' is not an input; did you mean friction_angle?"),
        ("max_rotation", "'max_rotation' is not an input (length, width, height, boulder.density, "),
    ],
)
def test_what_is_no_input_gets_the_nearest_one(word, message):
    with pytest.raises(UnknownNameError) as refused:
        named(word)
    assert str(refused.value).startswith(message)
