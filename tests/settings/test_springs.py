"""A vehicle's spring in stages: the form in the file, what it stands for, and what is wrong with others."""

import numpy as np
import pytest

from boulder_sweep.columns import INPUT_COLUMNS
from boulder_sweep.designs import REASONS, block_of
from boulder_sweep.settings import load
from docs.studies.json_schema import schema

K_2, FROM = "vehicle_second_spring_N_m", "vehicle_second_spring_from_m"
ONE = "spring: 3103.3e3"
TWO = "spring: [{stiffness: 3103.3 kN/m}, {beyond: 1 m, stiffness: 9000 kN/m}]"


def test_two_stages_are_three_entries(load_it, minimal):
    stages = load_it(minimal.replace(ONE, TWO))
    entries = load_it(minimal.replace(ONE, f"{ONE}\n  second_spring: 9e6\n  second_spring_from: 1"))
    assert stages.constants == entries.constants
    assert (stages.constants["vehicle_spring_N_m"], stages.constants[K_2], stages.constants[FROM]) == (3103.3e3, 9e6, 1)
    assert tuple(stages.plan.columns) == (*INPUT_COLUMNS, K_2, FROM)
    assert stages.resolved()["inputs"][K_2] == 9e6


def test_one_stage_is_one_spring(load_it, minimal):
    sweep = load_it(minimal.replace(ONE, "spring: [{stiffness: 3103.3 kN/m}]"))
    assert sweep.resolved() == load_it(minimal).resolved()
    assert tuple(sweep.plan.columns) == INPUT_COLUMNS


def test_every_number_may_be_an_axis_or_uncertain(load_it, minimal):
    spring = "spring: [{stiffness: [3, 4] MN/m}, {beyond: {from: 0.5 m, to: 1 m, count: 3}, stiffness: [8, 9] MN/m}]"
    sweep = load_it(minimal.replace(ONE, spring))
    assert [axis.name for axis in sweep.axes] == ["vehicle_spring_N_m", FROM, K_2]
    assert sweep.n_designs == 12
    spring = "spring: [{stiffness: 3 MN/m}, {beyond: 1 m, stiffness: {mean: 9 MN/m, cov: 10 %}}]"
    assert list(load_it(minimal.replace(ONE, spring)).distributions) == [K_2]


def test_named_vehicles_have_stages(load_it, minimal):
    head = minimal[: minimal.index("vehicle:")]
    one = "{name: %s, mass: 6722, speed: 14.5, spring: [{stiffness: %s}, {beyond: 1, stiffness: 9e6}], damper: 138e3}"
    sweep = load_it(f"{head}vehicle:\n  - {one % ('a', '3e6')}\n  - {one % ('b', '4e6')}\n")
    block = sweep.block(0, 2)
    assert block.columns["vehicle_spring_N_m"].to_numpy().tolist() == [3e6, 4e6]
    assert block.columns[K_2].to_numpy().tolist() == [9e6, 9e6]


def test_an_option_takes_the_place_of_a_stage(load_it, minimal):
    sweep = load_it(minimal.replace(ONE, TWO), "vehicle.second_spring=12 MN/m")
    assert sweep.constants[K_2] == 12e6
    assert K_2 not in load_it(minimal.replace(ONE, TWO), "vehicle.spring=3 MN/m").constants


@pytest.mark.parametrize(
    ("spring", "position", "words"),
    [
        ("spring: [{stiffness: 3e6}, {stiffness: 9e6}]", "15:30", "beyond and stiffness"),
        ("spring: [{stiffness: 3e6, beyond: 1}]", "15:12", "has stiffness"),
        (
            "spring: [{stiffness: 3e6}, {beyond: 1, stiffness: 4e6}, {beyond: 2, stiffness: 5e6}]",
            "15:11",
            "one stage or",
        ),
        ("spring: [{stiffness: 3e6}, 4e6]", "15:11", "one stage or two"),
        ("spring: [{stiffness: 3e6}, {beyond: 1, stiffness: 2e6}]", "15:42", "softer than the first"),
        ("spring: [{stiffness: 3e6}, {beyond: 0, stiffness: 9e6}]", "15:39", "outside the admitted range"),
        ("spring: 3e6\n  second_spring: 9e6", "16:3", "needs second_spring_from beside it"),
        ("spring: 3e6\n  second_spring_from: 1", "16:3", "needs second_spring beside it"),
        (f"{TWO}\n  second_spring: 9e6", "16:3", "in the stages of the spring, too"),
    ],
)
def test_mistakes(problems_of, minimal, spring, position, words):
    problems = problems_of(minimal.replace(ONE, spring))
    assert len(problems) == 1
    assert words in problems[0].message
    assert f"{problems[0].line}:{problems[0].column}" == position


def test_a_softer_second_spring_is_refused_row_by_row(load_it, minimal):
    spring = "spring: [{stiffness: 3 MN/m}, {beyond: 1 m, stiffness: [2, 3, 4] MN/m}]"
    sweep = load_it(minimal.replace(ONE, spring))
    block = sweep.block(0, 3)
    assert [block.reasons[row] for row in range(3)] == [REASONS[4], "", ""]
    again = block_of({name: column.to_numpy() for name, column in block.columns.items()})
    assert np.array_equal(again.reasons.codes, block.reasons.codes)
    assert list(again.columns) == list(block.columns)


def test_a_list_of_designs_has_its_columns(load_it, minimal, tmp_path):
    (tmp_path / "trucks.csv").write_text(f"vehicle_second_spring_kN_m,{FROM}\n9000,1\n8000,0.5\n")
    (tmp_path / "grid.yaml").write_text(f"table: trucks.csv\n{minimal}")
    sweep = load(tmp_path / "grid.yaml")
    assert sweep.block(0, 2).columns[K_2].to_numpy().tolist() == [9e6, 8e6]


def test_editors_know_the_stages():
    stages = schema()["$defs"]["stages"]
    assert [list(item["properties"]) for item in stages["prefixItems"]] == [["stiffness"], ["beyond", "stiffness"]]
