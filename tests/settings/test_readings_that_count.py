"""Which readings of an investigation decide: how strong, how deep and how complete they may be."""

from __future__ import annotations

import pytest

from boulder_sweep import investigation as sand
from boulder_sweep.errors import QuestionError
from boulder_sweep.settings.soil_readings import covered_depth
from boulder_sweep.settings.sweep import derived_words
from tests.answers.designs import bare_need

SITE = """\
boulder: {length: 1.65 m, width: 1.68 m, height: 3.4 m, density: 2600 kg/m^3}
site: {embedment_depth: 2.2 m}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
soil:
"""
ANGLE, REACTION = "friction_angle_deg", "subgrade_reaction_MN_m3"
STRONGEST = min(sand.STRONGEST["spt"].values())


def blows(*rows):
    """Return a borehole of counts at 60 % and depths."""
    return f"spt: [{', '.join(f'{{n: {n}, energy_ratio: 60 %, depth: {depth} m}}' for n, depth in rows)}]"


def cone(*rows):
    """Return the log of a cone as a list, a row a line."""
    return "cpt:\n" + "\n".join(f"    - {{q_c: {q} MPa, depth: {depth:.2f} m}}" for q, depth in rows)


def angle_of(n, depth):
    """Return the friction angle that one count gives [deg]."""
    count = sand.normalized_blow_count(n, 0.6, depth, sand.vertical_stress(depth, None))
    return min(sand.angles_by_blow_count(count).values())


@pytest.fixture
def site(load_it):
    """Load the site with readings, and with other entries in place of its own."""
    return lambda soil, *overrides: load_it(f"{SITE}  {soil}\n", *overrides)


@pytest.fixture
def refusal(problems_of):
    """Return the one problem of the site with readings."""

    def problem(soil, *overrides):
        (only,) = problems_of(f"{SITE}  {soil}\n", *overrides)
        return only

    return problem


def words_of(sweep):
    (words,) = derived_words(sweep.derived)
    return words


@pytest.mark.parametrize(
    ("soil", "angle", "words"),
    [
        (
            blows((19, 0.8), (22, 1.5), (50, 2.3)),
            angle_of(19, 0.8),
            ["the weakest of 3 readings", "1 reading at 2.3 m above the range of the correlation, taken as its end"],
        ),
        (
            blows((15, 1.5), (22, 3.0), (11, 9.0)),
            angle_of(15, 1.5),
            [
                "the weakest of 2 readings",
                "1 reading at 9 m left out, below the first one under the deepest foot (2.2 m)",
            ],
        ),
        ("spt: [{n60: 13, depth: 1.5 m}]", angle_of(13, 1.5), ["by N 13 (60 %) at 1.5 m, (N1)60 16.57"]),
        (blows((60, 1.5)), STRONGEST, ["1 reading at 1.5 m above the range"]),
        (blows((22, 1.5), (15, 2.3)), angle_of(15, 2.3), ["the weakest of 2 readings"]),
        (
            blows((22, 1.5), (25, 2.2), (14, 2.3), (11, 2.4)),
            angle_of(14, 2.3),
            ["weakest of 3", "1 reading at 2.4 m left"],
        ),
        (blows((22, 2.4), (25, 2.4), (4, 2.5), (3, 30)), angle_of(22, 2.4), ["2 readings at 2.5 to 30 m left out"]),
        (blows((22, 0)), min(sand.angles_by_blow_count(22 * 0.75 * 1.7).values()), ["N 22 (60 %) at 0 m"]),
        (
            "topsoil: 0.4 m\n  " + blows((2, 0.3), (22, 0.4), (24, 1.5)),
            angle_of(22, 0.4),
            ["the weakest of 2 readings", "1 reading at 0.3 m left out, in the topsoil"],
        ),
        (
            "spt: [{n1_60: 20, depth: 1.5 m}, {n1_60: 8, depth: 3 m}, {n1_60: 6, depth: 4 m}, {n1_60: 30}]",
            29.465,
            ["(N1)60 8 at 3 m, the weakest of 3 readings"],
        ),
        (
            "cpt: [{q_c: 40, depth: 1 m}, {q_c: 12, depth: 2 m}, {q_c: 9, depth: 3 m}, {q_c: 0, depth: 35 m}]",
            sand.kulhawy_mayne(9.0, sand.vertical_stress(3.0, None)),
            ["weakest of 3", "1 reading at 1 m above the range", "1 reading at 35 m left out"],
        ),
        ("cpt: {q_c: 40 MPa, depth: 1 m}", 46.0, ["by Robertson and Campanella 1983 it is 46 deg"]),
    ],
)
def test_the_weakest_of_the_readings_that_count_decides(site, soil, angle, words):
    sweep = site(soil + "\n  subgrade_reaction: 40")
    assert sweep.constants[ANGLE] == pytest.approx(angle, abs=1e-3)
    for part in words:
        assert part in words_of(sweep)


@pytest.mark.parametrize(
    ("written", "least"),
    [
        ("50/75mm", 50),
        ('50/3"', 50),
        ("50 / 75 mm", 50),
        ("50 blows for 75 mm", 50),
        ("20/0.5 ft", 20),
        ("20/300mm", 20),
        ("R", 50),
        ("refusal", 50),
        ("'>50'", 50),
        ("'>= 20'", 20),
        ("20+", 20),
    ],
)
@pytest.mark.parametrize("key", ["n: {}, energy_ratio: 60 %", "n60: {}"])
def test_a_test_that_was_given_up_has_at_least_its_blows(site, key, written, least):
    reading = f"spt: {{{key.format(written)}, depth: 8 m}}"
    sweep, plain = (site(f"{text}\n  subgrade_reaction: 40") for text in (reading, blows((least, 8))))
    assert sweep.constants[ANGLE] == plain.constants[ANGLE]
    assert ("N at least" in words_of(sweep)) == ("/300" not in written)


@pytest.mark.parametrize(
    ("reading", "position", "words"),
    [
        ("n: 50/75, energy_ratio: 60 %, depth: 2 m", "5:12", "write it as in 50/75mm"),
        ("n: 50/450mm, energy_ratio: 60 %, depth: 2 m", "5:12", "is no count of the last 300 mm (1 ft)"),
        ("n: 50/75 kg, energy_ratio: 60 %, depth: 2 m", "5:12", "a length is needed"),
        ("n: X, energy_ratio: 60 %, depth: 2 m", "5:12", "'X' is not a number"),
        ("n1_60: R", "5:16", "'R' is not a number"),
        ("n: >50, energy_ratio: 60 %, depth: 2 m", "5:12", "put the text in quotation marks"),
        ("n1_60: 20, energy_ratio: 60 %", "5:8", "not both"),
    ],
)
def test_readings_that_cannot_be_read(refusal, reading, position, words):
    problem = refusal(f"spt: {{{reading}}}")
    assert words in problem.message
    assert f"{problem.line}:{problem.column}" == position


GIVEN = {"friction_angle": "36 deg", "density": "1860 kg/m^3", "subgrade_reaction": "60 MN/m^3"}


@pytest.mark.parametrize("reading", [blows((60, 1.5)), blows((1, 1.5)), cone((0.1, 1.0)), "relative_density: 99 %"])
def test_where_every_constant_is_given_the_readings_are_only_kept(site, reading):
    sweep = site("\n  ".join([*(f"{key}: {value}" for key, value in GIVEN.items()), reading]))
    assert (sweep.constants[ANGLE], sweep.constants[REACTION], sweep.distributions) == (36.0, 60.0, {})
    assert len(sweep.resolved()["derived"]["soil"][0]["readings"]) == 1
    assert words_of(sweep) == "soil: the readings are kept for the record: the file gives every constant"


@pytest.mark.parametrize("given", [[], ["friction_angle"], ["density", "subgrade_reaction"], ["density"]])
@pytest.mark.parametrize("reading", [blows((1, 1.5)), cone((0.1, 1.0))])
def test_what_a_refusal_asks_for_is_enough(site, refusal, reading, given):
    """A reading below the range stands for nothing; every constant that the message names makes the file valid."""
    entries = [f"{key}: {GIVEN[key]}" for key in given]
    message = refusal("\n  ".join([reading, *entries])).message
    named = [key for key in GIVEN if f"soil.{key}" in message]
    assert sorted(named) == sorted(set(GIVEN) - set(given))
    assert site("\n  ".join([reading, *entries, *(f"{key}: {GIVEN[key]}" for key in named)]))


def test_rows_of_a_log_under_the_range_are_one_line(site, refusal):
    rows = [(0.3 if k < 15 else 9.0, 0.02 * k) for k in range(1, 442)]
    problem = refusal(cone(*rows))
    assert (problem.line, problem.column) == (6, 7)
    assert problem.message == (
        "the friction angle by 0.3 MPa is 24.52 deg; the correlation holds from 30 to 46 deg; 14 of the 111 readings "
        "that count are too weak for it, at 0.02 to 0.28 m; give soil.friction_angle, soil.density and "
        "soil.subgrade_reaction as measured; or, where this is topsoil, soil.topsoil: 0.3 m"
    )
    words = words_of(site(f"topsoil: 0.3 m\n  {cone(*rows)}"))
    assert "14 readings at 0.02 to 0.28 m left out, in the topsoil; 330 readings at 2.24 to 8.82 m left out" in words
    deeper = [(0.3 if k < 30 else 9.0, 0.02 * k) for k in range(1, 442)]
    assert "topsoil" not in refusal(cone(*deeper)).message


@pytest.mark.parametrize("row", ["{q_c: 9 m, depth: 1 m}", "{q_c: 9 MPa}", "{q_c: -1 MPa, depth: 1 m}"])
def test_the_same_mistake_in_every_row_is_one_line(refusal, row):
    assert refusal("cpt:\n" + 441 * f"    - {row}\n").line == 6


@pytest.mark.parametrize(
    ("soil", "words"),
    [
        ("topsoil: 0.6 m\n  " + blows((20, 1.5)), "outside the admitted range of 0 to 0.5 m"),
        ("topsoil: 0.3 m\n  relative_density: 60 %", "give it with spt or cpt"),
        ("topsoil: 0.3 m\n  friction_angle: 36\n  density: 1860\n  subgrade_reaction: 60", "give it with spt or cpt"),
        ("topsoil: 0.3 m\n  " + blows((20, 0.2)), "every reading lies in the topsoil"),
    ],
)
def test_topsoil_is_shallow_and_says_something_of_readings(refusal, soil, words):
    assert words in refusal(soil).message


@pytest.mark.parametrize(
    ("embedment", "foot"),
    [
        ("embedment_depth: 1.2 m", 1.2),
        ("embedment_depth: [1.2, 2.9] m", 2.9),
        ("embedment_depth: {mean: 1.2 m, sd: 0.1 m}", 1.7),
        ("embedment_depth: {distribution: uniform, low: 1 m, high: 1.4 m}", 1.4),
        ("embedment_ratio: 0.5", 1.7),
        ("embedment_ratio: {from: 0.4, to: 0.7, step: 0.1}", 2.38),
    ],
)
def test_the_deepest_foot_of_the_file_is_what_readings_reach_down_to(site, embedment, foot):
    """A reading every 0.5 m: the first under the foot is the last that counts."""
    depths = [0.5 * k for k in range(1, 12)]
    key, _, value = embedment.partition(": ")
    sweep = site(blows(*((40 - 4 * depth, depth) for depth in depths)), f"site.{key}={value}")
    (data,) = sweep.derived["soil"]
    assert data["foot_m"] == pytest.approx(foot)
    last = next(depth for depth in depths if depth > foot)
    assert [reading["depth_m"] for reading in data["readings"] if "left_out" not in reading][-1] == last
    assert covered_depth(sweep.derived) == last


def test_the_foot_of_a_profile_and_of_a_table(load_it, tmp_path):
    log = blows((30, 1.5), (25, 2.0), (20, 2.5), (15, 3.0))
    profile = "profile: [{height: 0, width: 1.5, length: 1.5}, {height: 3 m, width: 1.5, length: 1.5}]"
    text = SITE.replace("length: 1.65 m, width: 1.68 m, height: 3.4 m", profile)
    sweep = load_it(text.replace("embedment_depth: 2.2 m", "embedment_ratio: 60 %") + f"  {log}\n")
    assert sweep.derived["soil"][0]["foot_m"] == pytest.approx(1.8)
    (tmp_path / "designs.csv").write_text("boulder_height_m,embedment_ratio\n2.0,0.7\n4.0,0.4\n")
    text = SITE.replace(", height: 3.4 m", "").replace("site: {embedment_depth: 2.2 m}\n", "")
    sweep = load_it(f"table: {tmp_path / 'designs.csv'}\n{text}  {log}\n")
    assert sweep.derived["soil"][0]["foot_m"] == pytest.approx(1.6)


LOG = blows((25, 1.5), (22, 3.0), (18, 4.5))


@pytest.mark.parametrize(
    ("embedment", "least", "between", "entry"),
    [
        ("embedment_depth=1.2 m", "embedment_depth", None, "site.embedment_depth: [1.19, 2.9] m"),
        ("embedment_ratio=0.4", "embedment_depth", None, "site.embedment_depth: [1.19, 2.9] m"),
        ("embedment_depth=1.2 m", "embedment_ratio", None, "site.embedment_ratio: [0.35, 0.852941]"),
        ("embedment_ratio=0.4", "height", None, "boulder.height: [1.5, 4] m"),
        ("embedment_depth=1.2 m", "embedment_depth", ("1 m", "1.5 m"), "site.embedment_depth: [1, 1.5] m"),
        ("embedment_ratio=0.4", "mass", None, "boulder.height a range, which bounds the search"),
    ],
)
def test_a_search_below_the_readings_that_count_is_refused(site, embedment, least, between, entry):
    with pytest.raises(QuestionError) as caught:
        bare_need(site(LOG, f"site.{embedment}"), least, between=between)
    assert "the readings of the soil below 1.5 m were left out" in str(caught.value)
    assert f"they count where the file gives {entry}" in str(caught.value)
    key, bracket, values = entry.partition(": ")
    if bracket:
        instead = [f"site.{embedment}"] if key == "boulder.height" else []
        assert covered_depth(site(LOG, *instead, f"{key}={values}").derived) > 1.5


def test_beside_a_table_a_deeper_design_makes_more_readings_count(load_it, tmp_path):
    table = tmp_path / "designs.csv"
    text = f"table: {table}\n{SITE.replace('site: {embedment_depth: 2.2 m}', '')}  {LOG}\n"
    table.write_text("embedment_depth_m\n1.2\n")
    with pytest.raises(QuestionError, match=r"or they count where the table has a design with such a foot"):
        bare_need(load_it(text))
    table.write_text("embedment_depth_m\n1.2\n2.9\n")
    assert covered_depth(load_it(text).derived) == 3.0


def test_a_search_within_them_is_answered(site):
    answers = bare_need(site(LOG), "embedment_depth", between=("2.2 m", "2.9 m"))
    assert answers.counts()
