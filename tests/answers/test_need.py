"""The least that passes: every bracket is judged again as a run judges it, under second opinions, too."""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from boulder_sweep.answers.need import Need
from boulder_sweep.answers.printing import need_lines, uncertainty_lines
from boulder_sweep.answers.trials import Remembered, judges_of, ranges
from boulder_sweep.answers.uncertainty import uncertainty
from boulder_sweep.columns import OUTCOME_COLUMNS
from boulder_sweep.designs import DesignBlock, some
from boulder_sweep.errors import PictureError, QuestionError
from boulder_sweep.judge.accuracy import accuracy_of
from boulder_sweep.judge.evaluation import Evaluation, evaluation_of
from boulder_sweep.judge.judged import PASS, Judged
from boulder_sweep.judge.robustness import ROBUST
from boulder_sweep.settings import Sweep, load_text
from boulder_sweep.settings.model import SECOND_OPINIONS
from boulder_sweep.settings.sweep import DesignList
from tests.answers.designs import DEPTH, bare_need, passes, random_designs, site


def certify(found: Need) -> int:
    """Judge both ends of all brackets again; return how many brackets there were."""
    frame, column = found.frame, found.key.name
    there = frame[frame.passes_at.notna()]
    assert passes(found, there, there.passes_at, column).all()
    assert (there.verdict == "pass").all()
    bracketed = frame[frame.fails_at.notna()]
    assert not passes(found, bracketed, bracketed.fails_at, column).any()
    both = frame[frame.passes_at.notna() & frame.fails_at.notna()]
    assert np.allclose((both.passes_at - both.fails_at).abs(), found.key.step, rtol=1e-6)
    return len(both)


def test_brackets_of_random_designs_are_certified() -> None:
    found = bare_need(random_designs(2000), "embedment_depth")
    assert certify(found) >= 500
    counts = found.counts()
    assert sum(counts.values()) == len(found) == 2000
    assert set(counts) >= {"found", "always", "blocked_by_overlap"}
    assert "never" not in counts, "every range ends where the truck would go over the boulder"


@pytest.mark.parametrize("accuracy", ["fast", "fine"])
def test_brackets_hold_for_every_accuracy(accuracy: str) -> None:
    assert certify(bare_need(site(accuracy=accuracy))) >= 4


@pytest.mark.parametrize("accuracy", ["fast", "balanced", "fine"])
def test_as_printed_nothing_is_proved_so_nothing_is_found(accuracy: str) -> None:
    frame = bare_need(site(readings="as_printed", accuracy=accuracy)).frame
    stands = frame[frame.found == "undecided"]
    assert set(frame.found) == {"undecided", "blocked_by_overlap"}
    assert len(stands) >= 3
    assert set(zip(stands.verdict, stands.reason, strict=True)) == {("undecided", "horizon")}


@pytest.mark.parametrize(
    ("question", "column"),
    [
        ({"least": "height"}, "boulder_height_m"),
        ({"least": "friction_angle"}, "friction_angle_deg"),
        ({"least": "soil.density"}, "soil_density_kg_m3"),
        ({"least": "width"}, "boulder_width_m"),
        ({"most": "speed"}, "impact_speed_m_s"),
        ({"most": "vehicle.mass"}, "vehicle_mass_kg"),
    ],
)
def test_any_input_may_be_asked_for(question: dict[str, str], column: str) -> None:
    sweep = site(height="3 m", friction="[36, 38, 40, 42] deg", site="embedment_depth: [1.9, 2.0, 2.1, 2.2] m")
    found = bare_need(sweep, **question)
    sense = "most" if "most" in question else "least"
    assert found.key.answer == f"{sense}_{column}"
    certify(found)
    assert len(found) == (4 if column == "friction_angle_deg" else 16)


def test_ratio_as_key() -> None:
    depth = bare_need(site(), "embedment_depth").frame
    ratio = bare_need(site(), "embedment_ratio").frame
    assert np.allclose(
        ratio.least_embedment_ratio * ratio.boulder_height_m, depth.least_embedment_depth_m, atol=4e-3, equal_nan=True
    )


def test_an_axis_is_the_range() -> None:
    found = bare_need(site(site="embedment_ratio: [0.6, 0.62]", height="3.4 m")).frame
    assert found[DEPTH].between(0.6 * 3.4 - 1e-3, 0.62 * 3.4 + 1e-3).all()
    assert found.found.tolist() == ["never", "always"]
    assert found.fails_at[0] == pytest.approx(0.62 * 3.4, abs=1e-3)
    assert math.isnan(found.fails_at[1])


def test_margin_needs_more_depth() -> None:
    plain = bare_need(site()).frame
    more = bare_need(site(), margin="25 %")
    assert (more.frame.least_embedment_depth_m > plain.least_embedment_depth_m)[more.frame.passes_at.notna()].all()
    assert more.frame.margin[more.frame.passes_at.notna()].between(0.25, 0.27).all()


RINGS_ON = """
boulder: {length: 1.648 m, width: 1.327 m, height: 3.31 m, density: 2671 kg/m^3}
site: {embedment_depth: 1.266 m}
soil: {density: 1711 kg/m^3, friction_angle: 29.56 deg, subgrade_reaction: 9.91 MN/m^3, strain_rate_factor: 1.197}
vehicle: {mass: 2933 kg, speed: 8.887 m/s, spring: 2339.9 kN/m, damper: 297.6 kN*s/m}
"""


def test_a_margin_is_proved_to_last() -> None:
    """At the horizon of a second the verdict is proved, and the rotation still grows, by 0.7 degrees."""
    brief = load_text(RINGS_ON, Path("brief.yaml"))
    long = dataclasses.replace(brief, solver=dataclasses.replace(brief.solver, horizon_s=8.0))
    for asked, holds in ((0.0, True), (0.33, True), (0.36, False)):
        for sweep in (brief, long):
            judges = judges_of(sweep, asked)
            for evaluation in (judges.coarse, judges.final):
                rows = evaluation(sweep.block(0, 1))
                assert rows.verdict[0] == PASS
                assert judges.holds(rows, sweep.block(0, 1))[0] == holds
                assert rows["margin"][0] >= 0.375 or not holds or sweep is long
    question = {"margin": "36 %", "between": ("1.2 m", "1.4 m")}
    one, other = (bare_need(sweep, "embedment_depth", **question).frame.iloc[0] for sweep in (brief, long))
    assert (one.found, one.passes_within) == (other.found, other.passes_within) == ("not_monotone", "1.2 to 1.219")


def test_a_boulder_that_ends_below_the_bumper_is_no_answer() -> None:
    found = bare_need(site(height="2.6 m", friction="36 deg")).frame.iloc[0]
    assert found.found == "blocked_by_overlap"
    assert math.isnan(found.passes_at)
    assert found.fails_at < 2.6 - 0.5
    assert found[[*OUTCOME_COLUMNS]].isna().all()  # it has no answer, so it has no outcome


@pytest.mark.parametrize("count", [150, pytest.param(300, marks=pytest.mark.nightly)])
def test_what_is_not_monotone_is_said_with_all_that_passes(count: int) -> None:
    """Hardly buried, a boulder may slide less than is allowed; deeper it turns over; deeper still it is held."""
    found = bare_need(random_designs(count), between=("0.05 m", "1.2 m"))
    frame = found.frame[found.frame.found == "not_monotone"]
    assert len(frame) >= 5
    rows, inside, outside = [], [], []
    for place, text in enumerate(frame.passes_within):
        for stretch in text.split(", "):
            low, high = map(float, stretch.split(" to "))
            rows += [place, place]
            inside += [low, high]
            outside += [low - 1e-3 if low > 0.05 else np.nan, high + 1e-3 if high < 1.2 else np.nan]
    assert len(rows) > 2 * len(frame), "some pass twice"
    designs = frame.iloc[rows].reset_index(drop=True)
    assert passes(found, designs, pd.Series(inside), DEPTH).all()
    ends = np.isfinite(outside)
    assert not passes(found, designs[ends], pd.Series(outside)[ends], DEPTH).any()
    assert "*" in "\n".join(need_lines(found))


def test_answers_do_not_depend_on_the_threads() -> None:
    one, two = (bare_need(site(), jobs=jobs) for jobs in (1, 2))
    assert one.arrow.equals(two.arrow)


def test_rows_do_not_depend_on_their_neighbours() -> None:
    sweep = random_designs(40)
    whole = bare_need(sweep).frame
    assert sweep.table is not None
    for row in (3, 17):
        alone = DesignList("one.csv", {name: values[row : row + 1] for name, values in sweep.table.columns.items()})
        frame = bare_need(Sweep("one", None, (), sweep.constants, alone)).frame
        for name in ("found", "passes_at", "max_rotation_deg"):
            pd.testing.assert_series_equal(
                frame[name].astype(str), whole[name][row : row + 1].astype(str).reset_index(drop=True)
            )


def test_progress_counts_rows_or_the_values_tried_for_a_probability() -> None:
    """One row of many samples takes long: its progress moves, up to the end."""
    seen: list[tuple[int, int]] = []
    one = {"height": "3.2 m", "site": "embedment_depth: 2.2 m", "friction": "{mean: 40 deg, sd: 2 deg}"}
    bare_need(site(**one), probability=0.9, progress=lambda *now: seen.append(now))
    done, totals = zip(*seen, strict=True)
    assert len(set(totals)) == 1
    assert totals[0] > 10
    assert done[0] == 0
    assert done[-1] == totals[0]
    assert list(done) == sorted(set(done))
    assert len(done) > 5
    seen.clear()
    rows = len(bare_need(site(), progress=lambda *now: seen.append(now)))
    assert seen[0] == (0, rows)
    assert seen[-1] == (rows, rows)


@pytest.mark.parametrize(
    ("question", "message"),
    [
        ({"least": "density"}, r"ambiguous; use boulder\.density or soil\.density"),
        ({"least": "phi"}, "did you mean friction_angle"),
        ({"least": "depht"}, "is not an input"),
        ({"least": "speed", "most": "speed"}, "not both"),
        ({"between": ("2 m", "1 m")}, "less than the second"),
        ({"between": ("2 kg", "3 kg")}, "a length is needed"),
        ({"between": ("1 m", "50 m")}, "admitted range"),
        ({"margin": "120 %"}, "less than 100 %"),
        ({"margin": "-1"}, "less than 100 %"),
        ({"least": "mass"}, "give its sides as ranges, and `sweep need` names the lightest boulder that qualifies"),
        ({"most": "boulder.mass"}, "the mass of a boulder is not searched"),
        ({"least": "boulder_mass_kg"}, r"vehicle\.mass is the truck's"),
        (
            {"most": "speed", "between": ("12.001 m/s", "12.009 m/s")},
            r"12\.001 to 12\.009 m/s, holds no multiple of",
        ),
        (
            {"most": "speed", "between": ("12.001 m/s", "12.015 m/s")},
            r"12\.001 to 12\.015 m/s, holds only one multiple of",
        ),
        ({"between": ("1.9491 m", "1.9499 m")}, r"1\.9491 to 1\.9499 m, holds no multiple of its step, 0\.001 m; give"),
        ({"least": "embedment_ratio", "between": (0.6101, 0.6109)}, r"0\.6101 to 0\.6109, holds no multiple"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_questions_that_make_no_sense_are_refused(question: dict, message: str) -> None:
    with pytest.raises(QuestionError, match=message):
        bare_need(site(height="2.6 m"), **question)


def test_an_axis_between_two_multiples_is_refused() -> None:
    sweep = site(height="3 m", friction="40 deg", site="embedment_depth: [1.9491, 1.9499] m")
    with pytest.raises(QuestionError, match="holds no multiple"):
        bare_need(sweep)
    assert bare_need(sweep, between=("1.94 m", "1.96 m")).frame.passes_at[0] == 1.949


@pytest.mark.parametrize("question", [{}, {"least": "embedment_ratio"}])
def test_the_end_of_the_range_tells_what_is_blocked_and_not_the_last_multiple_before_it(question: dict) -> None:
    found = bare_need(site(height="2.6 m"), **question).frame
    assert found.found.tolist() == ["blocked_by_overlap", "blocked_by_overlap"]
    assert bare_need(site(height="2.6 m"), between=("1.5 m", "1.8 m")).frame.found[0] == "never"


@pytest.mark.parametrize("question", [{"between": ("1 m", "1.9 m")}, {"most": "impact_height"}])
@pytest.mark.parametrize(("least", "height"), [(0.25, 2.65), (0.0, 2.4)])
def test_one_height_tells_what_is_blocked_from_what_never_passes(question: dict, least: float, height: float) -> None:
    """Whatever the design at the end fails for: the truck goes over it, or it overturns with a little overlap."""
    heights = np.concatenate([height - np.arange(400, 0, -8) * 1e-3, height + np.array([-4e-4, 0.0, 4e-4, 8e-3])])
    sweep = site(height=str([float(own) for own in heights.round(4)]), friction="30 deg", site="embedment_depth: 1.9 m")
    sweep = dataclasses.replace(sweep, criterion=dataclasses.replace(sweep.criterion, min_overlap_m=least))
    found = bare_need(sweep, **question).frame.found
    blocked = heights < height - 1e-9 if least else heights <= height + 1e-9  # without overlap the truck passes over
    assert found.tolist() == np.where(blocked, "blocked_by_overlap", "never").tolist()


def test_a_curve_of_the_chart_holds_one_ratio_of_embedment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The table holds depths; the file gives ratios, of which the chart shows one and says which."""
    curves = []
    monkeypatch.setattr("boulder_sweep.views.answer_charts._curve", lambda *words: curves.append(words[2]))
    monkeypatch.setattr("matplotlib.axes.Axes.legend", lambda *_, **__: None)  # of no curve
    sweep = site(height="[3, 3.2, 3.4] m", friction="40 deg", site="embedment_ratio: [0.6, 0.65, 0.7]")
    bare_need(sweep, most="speed").plot(tmp_path / "chart.png")
    assert [rows.boulder_height_m.tolist() for rows in curves] == [[3.0, 3.2, 3.4]]
    assert (curves[0].embedment_depth_m / curves[0].boulder_height_m).tolist() == pytest.approx([0.65] * 3)


def test_ranges_that_are_narrow_by_themselves_are_searched() -> None:
    """Ends of half a millimetre where the truck goes over, no range at all, and one value that is not round."""
    found = bare_need(site(height="[0.7, 0.7696, 3] m", friction="40 deg")).frame
    assert found.found.tolist() == ["blocked_by_overlap", "blocked_by_overlap", "found"]
    one = bare_need(site(height="2.999 m", friction="40 deg", site="embedment_ratio: [0.7]")).frame
    assert one.found.tolist() == ["always"]


def test_a_partial_factor_on_the_angle_that_is_asked_for_is_refused() -> None:
    factored = dataclasses.replace(site(), partial_factor=1.25)
    with pytest.raises(QuestionError, match="multiply the tangent of the answer"):
        bare_need(factored, "friction_angle")


def test_table_has_units_and_settings(tmp_path: Path) -> None:
    found = bare_need(site())
    (path,) = found.write(tmp_path / "depths.parquet")
    schema = pq.read_schema(path)
    assert schema.field("least_embedment_depth_m").metadata[b"unit"] == b"m"
    assert json.loads(schema.metadata[b"boulder_sweep.question"])["asked"] == "least_embedment_depth_m"
    assert json.loads(schema.metadata[b"boulder_sweep.settings"])["name"] == "site"
    frame = pd.read_parquet(path)
    pd.testing.assert_frame_equal(frame, found.frame, check_exact=True)
    assert frame.attrs["units"]["fails_at"] == "m"
    with pytest.raises(QuestionError, match=r"must end in \.parquet"):
        found.write(tmp_path / "depths.csv")
    with pytest.raises(QuestionError, match="does not exist"):
        found.write(tmp_path / "missing" / "depths.parquet")


def test_chart_is_drawn(tmp_path: Path) -> None:
    bare_need(site()).plot(tmp_path / "chart.png")
    assert (tmp_path / "chart.png").stat().st_size > 10_000
    for least in ("embedment_depth", "boulder.height"):  # a point
        bare_need(site(height="3 m", friction="40 deg"), least).plot(tmp_path / f"{least}.png")
        assert (tmp_path / f"{least}.png").stat().st_size > 10_000
    with pytest.raises(PictureError, match="nothing passes"):
        bare_need(site(), margin="99 %").plot(tmp_path / "none.png")


def test_a_design_is_judged_once_with_the_accuracy_of_the_sweep(monkeypatch: pytest.MonkeyPatch) -> None:
    """The ends of a bracket are certified, searched again where they must, and reported: by the same judgement."""
    sweep = site(height="[3, 3.4] m")
    own = judges_of(sweep)
    judged: list[bytes] = []

    def counted(evaluation: Evaluation, block: DesignBlock) -> Judged:
        if evaluation.control.error_estimate:
            inputs = np.stack([column.to_numpy() for column in block.columns.values()], axis=1)
            judged.extend(row.tobytes() for row in inputs)
        return judge(evaluation, block)

    judge = Evaluation.__call__
    monkeypatch.setattr(Evaluation, "__call__", counted)
    found = bare_need(sweep, jobs=1)
    assert own.accuracy.error_estimate
    assert len(judged) == len(set(judged)) >= len(found)


def test_a_second_opinion_of_full_accuracy_is_asked_once_a_design(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []
    stand = Evaluation.stand

    def counted(evaluation: Evaluation, block: DesignBlock, tolerance_m: float | None = None) -> np.ndarray:
        asked.extend(block.columns[DEPTH].to_numpy().tolist() if tolerance_m is None else [])
        return stand(evaluation, block, tolerance_m)

    monkeypatch.setattr(Evaluation, "stand", counted)
    bare_need(site(height="3.4 m", friction="36 deg"), robust=True, jobs=1)
    assert len(asked) == len(set(asked)) > 1


@pytest.mark.parametrize(
    ("count", "expected"), [(0, [(0, 0)]), (4, [(0, 4)]), (5, [(0, 2), (2, 5)]), (10, [(0, 3), (3, 6), (6, 10)])]
)
def test_ranges_hold_all_and_are_no_larger_than_they_may(count: int, expected: list[tuple[int, int]]) -> None:
    assert list(ranges(count, 4)) == expected


def test_judging_again_gives_the_same_rows() -> None:
    sweep = site(height="[3, 3.4] m", site="embedment_depth: [2.0, 2.1, 2.2] m")
    block = sweep.block(0, sweep.n_designs)
    remembered, direct = Remembered(judges_of(sweep)), judges_of(sweep).final
    some_rows, again = some(block, np.array([3, 1, 3])), some(block, np.arange(len(block))[::-1])
    for asked, count in ((some_rows, 2), (again, len(block)), (some_rows, len(block))):
        mine, theirs = remembered(asked), direct(asked)
        assert remembered.count == count
        assert mine.words == theirs.words
        for name, values in theirs.columns.items():
            np.testing.assert_array_equal(mine[name], values)


def test_the_least_robust_depth_is_robust_and_the_next_one_is_not() -> None:
    sweep = site(height="[2.8, 3] m", width="2.4 m")
    found = bare_need(sweep, robust=True)
    evaluation = evaluation_of(sweep, accuracy_of(sweep)).asked()
    rows = [row for row in found.arrow.to_pylist() if row["passes_at"] is not None]
    assert len(rows) >= 3
    for row in rows:
        assert row["robustness"] == "robust"
        assert row["stands_under"] in ("paper;width_capped", None)  # none is asked in the free region
        at = [row["passes_at"], row["fails_at"]]
        given = sweep.constants | {name: row[name] for name in ("boulder_height_m", "friction_angle_deg")}
        given.pop("embedment_ratio", None)
        grades = []
        for depth in at:
            one = replace(sweep, axes=(), constants=given | {"embedment_depth_m": depth}, table=None)
            judged = evaluation(one.block(0, 1))
            grades.append(judged.verdict[0] == PASS and judged["robustness"][0] == ROBUST)
        assert grades == [True, False]


def test_robust_costs_depth_and_answers_are_graded_without_asking() -> None:
    sweep = site(height="[3, 3.4] m")
    least, robust = (bare_need(sweep, robust=asked) for asked in (False, True))
    depths = [np.array(found.arrow["passes_at"].to_pylist(), dtype=float) for found in (least, robust)]
    both = np.isfinite(depths[0]) & np.isfinite(depths[1])
    assert (depths[1][both] > depths[0][both]).all()
    grades = [grade for grade, depth in zip(least.arrow["robustness"].to_pylist(), depths[0], strict=True) if depth > 0]
    assert set(grades) == {"sensitive"}
    assert any(line.startswith("sensitive: a second opinion overturns it") for line in need_lines(least, notes=True))
    assert any(line.startswith("robust: stands with friction") for line in need_lines(robust, notes=True))


def test_what_second_opinions_do_not_know_is_refused_in_words() -> None:
    assumed = site()
    assumed = replace(assumed, model=replace(assumed.model, rock_assumed=True))
    with pytest.raises(QuestionError, match="second opinions know rock"):
        bare_need(assumed, robust=True)
    assert set(bare_need(assumed).arrow["robustness"].to_pylist()) <= {"open", None}


def test_no_grade_stands_beside_a_probability() -> None:
    """The grade would hold for the mean soil, and says nothing about the designs drawn."""
    sweep = site(friction="{mean: 40 deg, sd: 1 deg}", height="3.4 m")
    asked = replace(sweep, model=replace(sweep.model, second_opinion=SECOND_OPINIONS))
    found, likely = uncertainty(asked, half_width=0.2), bare_need(asked, probability=0.9)
    assert likely.counts() == {"found": 1}
    for answers, lines in ((found, uncertainty_lines(found)), (likely, need_lines(likely, notes=True))):
        assert answers.arrow["robustness"].to_pylist() == [None]
        assert answers.arrow["stands_under"].to_pylist() == [None]
        assert not any(word in "\n".join(lines) for word in ("robust:", "sensitive", "opinion:"))


SPEED = "impact_speed_m_s"
TAPERED = {"height": "3.4 m, taper: 0.8", "friction": "38 deg"}


def test_the_fastest_truck_that_a_tapered_boulder_withstands() -> None:
    found = bare_need(site(**TAPERED), most="speed")
    assert passes(found, found.frame, found.frame.passes_at, SPEED).all()
    assert not passes(found, found.frame, found.frame.fails_at, SPEED).any()
    assert (found.frame.fails_at - found.frame.passes_at).between(0.0, 0.01).all()
