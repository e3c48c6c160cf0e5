"""Questions about a vehicle whose front stiffens: the second spring is an input as any other."""

import pytest

from boulder_sweep import load, need, uncertainty
from boulder_sweep.answers.printing import need_lines
from boulder_sweep.errors import QuestionError

STAGES = "vehicle.spring=[{stiffness: 3103.3 kN/m}, {beyond: 0.5 m, stiffness: %s}]"


def test_the_least_depth_depends_on_it() -> None:
    alone = need(load("configs/rwg.yaml"))
    stiff = need(load("configs/rwg.yaml", [STAGES % "9 MN/m"]))
    assert stiff.frame.passes_at[0] < alone.frame.passes_at[0] - 0.02
    assert stiff.frame.vehicle_second_spring_N_m[0] == 9e6


def test_it_may_be_uncertain_and_what_decides() -> None:
    spread = ["vehicle.second_spring={distribution: uniform, low: 3.2 MN/m, high: 30 MN/m}", "vehicle.speed=14.9 m/s"]
    found = uncertainty(load("configs/rwg.yaml", [STAGES % "9 MN/m", "site.embedment_depth=1.75 m", *spread]))
    row = found.frame.iloc[0]
    assert row.p_pass_driver == "vehicle.second_spring"
    assert 0.0 <= row.p_pass_low <= row.p_pass <= row.p_pass_high <= 1.0
    fixed = load("configs/rwg.yaml", [STAGES % "9 MN/m", "vehicle.mass={mean: 6722 kg, cov: 5 %}"])
    assert uncertainty(fixed).frame.vehicle_second_spring_N_m[0] == 9e6


def test_it_is_shown_where_it_varies() -> None:
    front = ["vehicle.second_spring=[4000 kN/m, 20000 kN/m]", "vehicle.second_spring_from=[0.2, 0.3] m"]
    lines = need_lines(need(load("configs/rwg.yaml", front)))
    assert lines[0].split()[:4] == ["spring", "2", "beyond", "depth"]
    shown = [line.split()[:2] for line in lines[3:7]]
    assert shown == [["4e+06", "0.2"], ["4e+06", "0.3"], ["2e+07", "0.2"], ["2e+07", "0.3"]]


@pytest.mark.parametrize(
    ("question", "low", "high"),
    [
        ({"most": "second_spring"}, 3.1033e6, 5e7),
        ({"least": "second_spring"}, 3.1033e6, 5e7),
        ({"least": "second_spring_from"}, 1e-3, 2.9),
        ({"most": "spring"}, 2e5, 9e6),
    ],
)
def test_it_is_asked_for_where_the_front_stiffens(question: dict[str, str], low: float, high: float) -> None:
    found = need(load("configs/rwg.yaml", [STAGES % "9 MN/m"]), **question)
    row = found.frame.iloc[0]
    assert row.found != "blocked_by_overlap"
    assert low <= row[found.key.name] <= high
    assert need_lines(found)[3]


@pytest.mark.parametrize("key", ["second_spring", "second_spring_from"])
def test_it_is_not_asked_for_where_there_is_none(key: str) -> None:
    with pytest.raises(QuestionError, match="has no second spring; give it both"):
        need(load("configs/rwg.yaml"), key)
