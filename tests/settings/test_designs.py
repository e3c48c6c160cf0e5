"""Blocks of designs against a plain product of the axes, at any size, without ever making the grid."""

import itertools
import pickle
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from boulder_sweep.columns import INPUT_COLUMNS
from boulder_sweep.designs import MAX_DICTIONARY, DesignPlan, Source, impact_height_of_face
from boulder_sweep.settings import load_text
from tests.settings.conftest import MINIMAL

KEYS = {
    "boulder_length_m": "boulder.length",
    "boulder_height_m": "boulder.height",
    "embedment_ratio": "site.embedment_ratio",
    "embedment_depth_m": "site.embedment_depth",
    "impact_height_m": "site.impact_height",
    "friction_angle_deg": "soil.friction_angle",
    "impact_speed_m_s": "vehicle.speed",
    "bumper_height_m": "vehicle.bumper_height",
    "hood_height_m": "vehicle.hood_height",
}


def _reason(row):
    """Say plainly, for one row, why it cannot be computed."""
    exposed = row["boulder_height_m"] - row["embedment_depth_m"]
    if exposed <= 0:
        return "embedment depth is not less than the boulder's height"
    if row["hood_height_m"] < row["bumper_height_m"]:
        return "hood is lower than the bumper"
    given = row.get("given_impact_height", 0.0)
    if given > exposed * (1 + 1e-12) and exposed > row["bumper_height_m"]:
        return "impact height is above the top of the boulder"
    return ""


def _rows(sweep):
    """Write the grid out with itertools.product, row by row."""
    for values in itertools.product(*(axis.values.tolist() for axis in sweep.axes)):
        row = dict(sweep.constants) | dict(zip((axis.name for axis in sweep.axes), values, strict=True))
        if "embedment_ratio" in row:
            row["embedment_depth_m"] = row.pop("embedment_ratio") * row["boulder_height_m"]
        if "impact_height_m" in row:
            row["given_impact_height"] = row["impact_height_m"]
        else:
            face = min(row["boulder_height_m"] - row["embedment_depth_m"], row["hood_height_m"])
            row["impact_height_m"] = 0.5 * (face + row["bumper_height_m"])
        yield row


def _check(sweep, start, stop):
    rows = list(itertools.islice(_rows(sweep), start, stop))
    block = sweep.block(start, stop)
    assert (block.start, block.stop, len(block)) == (start, stop, stop - start)
    assert block.design_id().tolist() == list(range(start, stop))
    assert tuple(block.columns) == INPUT_COLUMNS
    for name, column in block.columns.items():
        assert column.to_numpy().tolist() == [row[name] for row in rows], name
        assert len(column) == stop - start
        if column.codes is not None:
            assert column.codes.dtype == np.int32
            assert len(np.unique(column.values)) == len(column.values)
    assert [block.reasons[k] for k in range(len(block))] == [_reason(row) for row in rows]
    assert block.reasons.any == any(_reason(row) for row in rows)


@st.composite
def grids(draw):
    """Axes in any order, embedment in either way, possible and impossible combinations mixed."""
    names = draw(st.permutations(sorted(KEYS)))
    way = draw(st.sampled_from(["embedment_ratio", "embedment_depth_m"]))
    other = "embedment_depth_m" if way == "embedment_ratio" else "embedment_ratio"
    chosen = [name for name in names if name != other and (name == way or draw(st.booleans()))]
    within = {"embedment_ratio": (0.1, 1.0), "friction_angle_deg": (20, 45), "impact_speed_m_s": (0, 30)}
    overrides = []
    for name in chosen:
        low, high = within.get(name, (0.2, 3.0))
        numbers = st.floats(low, high).map(lambda value: round(value, 2))
        values = draw(st.lists(numbers, min_size=1, max_size=4))
        overrides.append(f"{KEYS[name]}={values}")
    return overrides


@settings(max_examples=150, deadline=None)
@given(grid=grids(), data=st.data())
def test_any_block_of_any_grid_equals_the_product(grid, data):
    sweep = load_text(MINIMAL, Path("grid.yaml"), [*grid, "allow_unusual=all"])
    start = data.draw(st.integers(0, sweep.n_designs))
    stop = data.draw(st.integers(start, min(sweep.n_designs, start + 200)))
    _check(sweep, start, stop)


def test_the_whole_example(load_it, example):
    sweep = load_it(example)
    _check(sweep, 0, sweep.n_designs)


@pytest.mark.parametrize(("start", "stop"), [(-1, 3), (3, 2), (0, 2737), (2737, 2737)])
def test_rows_outside_of_the_grid(load_it, example, start, stop):
    with pytest.raises(IndexError, match="2736 designs"):
        load_it(example).block(start, stop)


@pytest.mark.parametrize("numbers", [[0], [7], [0, 3, 17, 2735], list(range(5, 2736, 37))])
def test_chosen_designs_are_those_of_the_grid(load_it, example, numbers):
    sweep = load_it(example)
    chosen, whole = sweep.plan.selection(np.array(numbers)), sweep.block(0, sweep.n_designs)
    assert len(chosen) == len(numbers)
    assert chosen.design_id().tolist() == numbers
    for name, column in chosen.columns.items():
        assert column.to_numpy().tolist() == whole.columns[name].to_numpy()[numbers].tolist(), name
    assert chosen.reasons.codes.tolist() == np.asarray(whole.reasons.codes)[numbers].tolist()
    with pytest.raises(IndexError):
        sweep.plan.selection(np.array([2736]))


HUGE = (
    "boulder.height={from: 1.5, to: 4, count: 1000}",
    "boulder.width={from: 1, to: 2, count: 1000}",
    "soil.friction_angle={from: 30, to: 45, count: 1000}",
    "vehicle.speed={from: 10, to: 20, count: 1000}",
)


def test_ten_to_the_twelve_designs_load_and_stream(load_with):
    tracemalloc.start()
    sweep = load_with(*HUGE)
    assert sweep.n_designs == 10**12
    block = sweep.block(10**12 - 3, 10**12)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20_000_000
    assert block.columns["impact_speed_m_s"].to_numpy()[-1] == 20.0
    assert block.columns["boulder_height_m"].to_numpy().tolist() == [4.0] * 3
    digits = 123_456_789_012
    row = sweep.block(digits, digits + 1).columns
    assert row["impact_speed_m_s"].to_numpy()[0] == sweep.axes[3].values[12]
    assert row["friction_angle_deg"].to_numpy()[0] == sweep.axes[2].values[789]
    assert row["boulder_height_m"].to_numpy()[0] == sweep.axes[1].values[456]
    assert row["boulder_width_m"].to_numpy()[0] == sweep.axes[0].values[123]


@pytest.mark.parametrize("start", [0, 2**31 - 3, 2**32 - 3, 10**10 - 3, 10**12 - 5])
def test_rows_are_the_same_on_either_side_of_32_bits(start):
    """Rows, strides and lengths beyond 32 bits; an axis that changes every ten thousand million rows, too."""
    lengths = (100, 100_000, 100_000)
    axes = [np.arange(length, dtype=float) for length in lengths]
    names = ("boulder_height_m", "boulder_width_m", "boulder_density_kg_m3")
    given = {name: Source(np.ones(1)) for name in (*INPUT_COLUMNS, "hood_height_m", "bumper_height_m")}
    given |= {name: Source(axis, (position,)) for position, (name, axis) in enumerate(zip(names, axes, strict=True))}
    block = DesignPlan(lengths, given).block(start, start + 5)
    rows = np.arange(start, start + 5)
    for name, positions in zip(names, np.unravel_index(rows, lengths), strict=True):
        assert block.columns[name].to_numpy().tolist() == positions.tolist(), name


def test_more_designs_than_can_be_numbered_are_refused(problems_of, minimal):
    (problem,) = problems_of(
        minimal,
        "allow_unusual=all",
        *HUGE,
        *(f"vehicle.{key}={{from: 1e6, to: 2e6, count: 1000}}" for key in ("spring", "damper", "mass")),
    )
    assert f"{10**21} designs" in problem.message


def test_combinations_too_many_for_a_dictionary_are_worked_out_per_row(load_with):
    count = 300
    sweep = load_with(
        f"boulder.height={{from: 2, to: 4, count: {count}}}",
        f"site.embedment_ratio={{from: 0.4, to: 1.0, count: {count}}}",
    )
    assert count**2 > MAX_DICTIONARY
    block = sweep.block(count - 2, count + 1)
    assert block.columns["embedment_depth_m"].codes is None
    assert block.columns["boulder_height_m"].codes is not None
    _check(sweep, count - 2, count + 1)
    _check(sweep, count**2 - 50, count**2)


def test_a_long_list_of_ever_different_values_is_no_dictionary():
    source = Source(np.random.default_rng(1).random(3 * MAX_DICTIONARY), (0,))
    source.find_dictionary()
    lookup, dictionary = source.dictionary
    assert lookup is None
    assert dictionary is not None
    assert len(dictionary) == len(source.values)


def test_sweeps_travel_to_other_processes(load_it, example):
    sweep = load_it(example)
    again = pickle.loads(pickle.dumps(sweep))
    assert again.resolved() == sweep.resolved()
    for one, other in zip(sweep.block(5, 9).columns.values(), again.block(5, 9).columns.values(), strict=True):
        assert one.to_numpy().tolist() == other.to_numpy().tolist()


def test_impact_height() -> None:
    """Eq 9: halfway up the face that truck and boulder share; the paper's own heights follow from it."""
    assert impact_height_of_face(3.44, 2.03, 0.5, 1.4) == pytest.approx(0.95)
    assert impact_height_of_face(2.2, 1.2, 0.508, 1.4) == pytest.approx(0.754)
    assert impact_height_of_face(2.2, 1.2, 0.5, 0.8) == pytest.approx(0.65)
