"""``sweep speed``: the speed that the street gives, in all units, and as a file takes it."""

from __future__ import annotations

import json

import pytest

from boulder_sweep.settings import load

WAY = (
    "--length",
    "80 m",
    "--from",
    "20 mph",
    "--acceleration",
    "1.2 m/s^2",
    "--curve-radius",
    "30 ft",
    "--grade",
    "-2 %",
)


def test_it_is_the_speed_of_the_file(sweep, grid):
    code, out, err = sweep("speed", *WAY)
    assert (code, err) == (0, "")
    text = grid.read_text().replace("speed: 30 mph", out[out.index("approach: ") : out.index(",\n          ...}")])
    grid.write_text(text)
    code, found, _ = sweep("speed", *WAY, "--json")
    assert code == 0
    data = json.loads(found)
    assert load(grid).derived["approach"] == [data]
    assert load(grid).constants["impact_speed_m_s"] == data["impact_speed_m_s"]
    speed = data["impact_speed_m_s"]
    assert f"{speed:.2f} m/s = {3.6 * speed:.1f} km/h = {speed / 0.44704:.1f} mph" in out
    assert "class of ASTM F2656 for it M40 (40 mph)" in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "lacks length"),
        (("--length", "80", "--from", "0 mph", "--acceleration", "1 m/s^2"), "--length 80: write the unit too"),
        (("--length", "80 m", "--from", "0", "--acceleration", "1 m/s^2"), "--from 0: write the unit too"),
        (("--length", "80 m", "--from", "0 mph"), "lacks acceleration"),
        (("--length", "80 m", "--from", "0 mph", "--acceleration", "fast"), "'fast' is not a number"),
        (("--length", "80 m", "--from", "0 mph", "--acceleration", "0 m/s^2"), "does not reach the boulder"),
    ],
)
def test_what_is_refused(sweep, words, said):
    code, out, err = sweep("speed", *words)
    assert (code, out) == (2, "")
    assert said in err


def test_a_class_only_where_there_is_one(sweep):
    fast = ("--length", "0 m", "--from", "60 mph", "--acceleration", "1 m/s^2")
    assert "none (M goes up to 50 mph)" in sweep("speed", *fast)[1]
    slow = ("--length", "0 m", "--from", "30 mph", "--acceleration", "1 m/s^2")
    assert "for it M30 (30 mph)" in sweep("speed", *slow)[1]


def test_commands_say_how_a_speed_follows(sweep, grid):
    grid.write_text(grid.read_text().replace("speed: 30 mph", "approach: {length: 50 m, from: 0, acceleration: 1}"))
    code, _, err = sweep("check", grid)
    assert code == 0
    words = "vehicle.speed: 10 m/s (22.4 mph) is the most that reaches the boulder: from rest, over 50 m with 1 m/s^2"
    assert " ".join(err.split()) == f"note: {words}"
    assert max(map(len, err.splitlines())) <= 80
