"""Logs of boreholes and cones as files: what is read of each format, what soil follows, what is refused."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boulder_sweep import investigation as sand
from boulder_sweep import need
from boulder_sweep.errors import QuestionError
from boulder_sweep.settings import SettingsError, load_text
from boulder_sweep.settings.logs import count_of
from boulder_sweep.settings.soil_readings import (
    BELOW_FOOT,
    FEWEST,
    HARD_SPOT,
    IN_TOPSOIL,
    WINDOW_M,
    covered_depth,
    layers_of,
    soil_words,
)
from boulder_sweep.settings.sweep import derived_words
from boulder_sweep.views.log_text import log_lines
from tests.settings.log_files import ags_cone, ags_counts, bro, gef, table, written

SITE = """\
boulder: {length: 1.65 m, width: 1.68 m, height: 3.4 m, density: 2600 kg/m^3}
site: {embedment_depth: 2.0 m}
vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}
soil:
"""
ANGLE, DENSITY, REACTION = "friction_angle_deg", "soil_density_kg_m3", "subgrade_reaction_MN_m3"
COUNTS = [(0.5, 17), (0.9, 19), (1.4, 18), (2.2, 21)]
CONE = [(round(0.02 * at, 2), 9.0 + 0.5 * (at % 3)) for at in range(1, 400)]
SPT = "soil: {log: FILE, energy_ratio: 60 %}"


@pytest.fixture
def site(tmp_path):
    """Load the site with the entries of a soil, beside which files lie."""

    def loaded(soil, name="", text="", *overrides):
        if name:
            written(tmp_path, name, text)
        return load_text(f"{SITE}  {soil}\n", tmp_path / "grid.yaml", overrides)

    return loaded


@pytest.fixture
def refusal(site):
    """Return the one problem of a log."""

    def problem(name, text, soil="log: FILE"):
        with pytest.raises(SettingsError) as caught:
            site(soil.replace("FILE", name), name, text)
        (only,) = caught.value.problems
        return only

    return problem


def log_of(sweep):
    (data,) = sweep.derived["soil"]
    return data


def readings_of(sweep, name):
    return [(round(reading["depth_m"], 4), round(reading[name], 6)) for reading in log_of(sweep)["readings"]]


# --- Formats ---

FILES = {
    "plain.csv": table("Depth (m),N", COUNTS),
    "names.csv": table("Depth [m bgl];SPT N-value", COUNTS, ";"),
    "suffix.csv": table("depth_m,N_value", COUNTS),
    "feet.csv": table("Depth (ft),Blows (per ft)", [(z / 0.3048, n) for z, n in COUNTS]),
    "capitals.csv": table("DEPTH (FT),BLOWS/FT", [(z / 0.3048, n) for z, n in COUNTS]),
    "words.csv": table("Depth in ft,Uncorrected N", [(z / 0.3048, n) for z, n in COUNTS]),
    "quoted.csv": table('"Depth, m","SPT ""N"" value"', COUNTS),
    "commas.csv": "Depth (m);N\n" + "".join(f"{z:.2f};{n}\n".replace(".", ",") for z, n in COUNTS),
    "increments.csv": table("Depth (m),Blow Count", [(z, f"4-{n - 9}-9") for z, n in COUNTS]),
    "tabs.csv": "# comment\n" + table("Depth (m)\tN\n", COUNTS, "\t"),
    "counts.ags": ags_counts({"BH1": COUNTS}, ratio=""),
    "feet.ags": ags_counts({"BH1": COUNTS}, ratio="", unit="ft", size=0.3048),
}


@pytest.mark.parametrize("name", FILES)
def test_blow_counts_are_read_of_every_format(site, name):
    sweep = site(f"log: {name}\n  energy_ratio: 60 %", name, FILES[name])
    assert readings_of(sweep, "n") == COUNTS
    assert derived_words(sweep.derived)[0].startswith(f"soil: {name}{', hole BH1' * name.endswith('.ags')}; friction")
    assert {reading["energy_ratio"] for reading in log_of(sweep)["readings"]} == {0.6}


CONES = {
    "cone.csv": table("Depth (m),qc (MPa)", CONE),
    "kilo.csv": table("Depth [m],Cone resistance [kPa]", [(z, 1e3 * q) for z, q in CONE]),
    "tsf.csv": table("Depth (ft),qc (tsf)", [(z / 0.3048, q / 0.0957605179586737) for z, q in CONE]),
    "suffix.csv": table("depth_m,qc_MPa", CONE),
    "spaces.csv": table("depth m,qt MPa", CONE),
    "capitals.csv": table("DEPTH (M),CONE RESISTANCE QC (MPA)", CONE),
    "cone.ags": ags_cone({"CPT1": CONE}),
    "kilo.ags": ags_cone({"CPT1": CONE}, unit="kPa", size=1e-3),
    "cone.gef": gef(CONE),
    "separated.gef": gef(CONE, separator=";", ending="!"),
    "deep.gef": gef(CONE, depth="m"),
    "indented.gef": gef(CONE).replace("#", "  #"),
    "cone.xml": bro(CONE),
}


@pytest.mark.parametrize("name", CONES)
def test_cones_are_read_of_every_format_and_averaged_over_windows(site, name):
    sweep = site(f"log: {name}", name, CONES[name])
    readings = log_of(sweep)["readings"]
    assert len(readings) == 32  # 8 m of windows
    assert readings[0]["depth_m"] == pytest.approx(np.mean([z for z, _ in CONE[:12]]), abs=1e-9)
    window = [q for _, q in CONE[12:24]]
    assert readings[1]["q_c_MPa"] == pytest.approx(min(np.mean(window), np.median(window)), rel=1e-6)
    assert log_of(sweep)["method"] == "cpt"


def test_a_spreadsheet_is_read_as_a_table(site, tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in [("Depth (m)", "N"), *COUNTS, (3.0, "50/75mm")]:
        book.active.append(row)
    book.save(tmp_path / "log.xlsx")
    sweep = site("log: log.xlsx\n  energy_ratio: 60 %")
    assert readings_of(sweep, "n") == [*COUNTS, (3.0, 50)]


def test_a_url_is_opened_as_that_of_a_list_of_designs(site, tmp_path):
    written(tmp_path, "log.csv", FILES["plain.csv"])
    assert readings_of(site(f"log: file://{tmp_path}/log.csv\n  energy_ratio: 60 %"), "n") == COUNTS


@pytest.mark.parametrize(
    ("cell", "text"),
    [
        ("13", "13"),
        ("5-6-7", "13"),
        ("5 - 6 - 7", "13"),
        ("5-6-7-9", "13"),
        ("12-25-50/75mm", ">75"),
        ("25-50/75mm", ">50"),
        ("50/75mm", "50/75mm"),
        ("5-6", "5-6"),
        ("R", "R"),
        ("WOH", "0"),
        ("woh/18 in", "0"),
        ("WR-WOH-2", "2"),
        (">50", ">50"),
        ("-", ""),
    ],
)
def test_increments_count_without_the_first(cell, text):
    assert count_of(cell) == text


@pytest.mark.parametrize(
    ("row", "n", "is_least"),
    [
        ({"ISPT_NVAL": "35", "ISPT_NPEN": "450", "ISPT_REP": "6,8/8,9,9,9 N=35"}, 35, False),
        ({"ISPT_NVAL": "200", "ISPT_MAIN": "50", "ISPT_NPEN": "225"}, 50, True),
        ({"ISPT_NVAL": "200", "ISPT_NPEN": "140"}, 50, True),
        ({"ISPT_NVAL": "28", "ISPT_NPEN": "440"}, 28, True),
        ({"ISPT_REP": "6,8/8,9,9,9 N=35"}, 35, False),
        ({"ISPT_REP": "25,25/50 for 75mm"}, 50, True),
        ({"ISPT_REP": "50/75mm"}, 50, True),
        ({"ISPT_REP": "N>50"}, 50, True),
        ({"ISPT_NPEN": "100"}, 50, True),
    ],
)
def test_tests_of_ags_that_were_given_up_are_at_least_so_much(site, row, n, is_least):
    columns = ["ISPT_TOP", "ISPT_ERAT", *row]
    text = "\n".join(
        ",".join(f'"{cell}"' for cell in cells)
        for cells in (
            ("GROUP", "ISPT"),
            ("HEADING", "LOCA_ID", *columns),
            ("UNIT", "", "m", "%", *("mm" if name == "ISPT_NPEN" else "" for name in row)),
            ("TYPE", "ID", "2DP", "0DP", *("X" for _ in row)),
            ("DATA", "BH1", "1.5", "72", *row.values()),
        )
    )
    (reading,) = log_of(site("log: site.ags", "site.ags", text))["readings"]
    assert (reading["n"], "at_least" in reading, reading["energy_ratio"]) == (n, is_least, 0.72)


def test_the_energy_of_the_file_counts_before_that_of_the_settings(site):
    for column, ratio in (("Energy ratio (%)", "72"), ("ER", "0.72"), ("ER", "72 %")):
        text = f"Depth (m),N,{column}\n0.5,17,{ratio}\n1.0,18,\n"
        sweep = site("log: log.csv\n  energy_ratio: 60 %", "log.csv", text)
        assert readings_of(sweep, "energy_ratio") == [(0.5, 0.72), (1.0, 0.6)]


@pytest.mark.parametrize(("column", "name"), [("N60", "n"), ("(N1)60", "n1_60")])
def test_corrected_counts_need_no_energy(site, column, name):
    assert readings_of(site("log: log.csv", "log.csv", table(f"Depth (m),{column}", COUNTS)), name) == COUNTS


def test_an_energy_that_is_no_share_is_told_the_percent(refusal):
    problem = refusal("log.csv", table("Depth (m),N", COUNTS), "log: FILE\n  energy_ratio: 70")
    assert problem.message == "energy_ratio: 70 is outside the admitted range of 0.3 to 1 (60 % is usual); write 70 %"


def test_one_count_is_no_plural(site):
    words = derived_words(
        site("log: log.csv\n  energy_ratio: 60 %", "log.csv", table("Depth (m),N", [(1, 20)])).derived
    )
    assert "by 1 blow count at 0 to" in words[0]


def test_what_is_not_used_is_said_in_one_line(site):
    text = "Hole,Depth (m),N,N60,Recovery,Note\nB,0.5,17,17,60,x\nB,1,,,0,none\nB,,18,,,\nB,1.5,18,18,60,\n"
    (words,) = derived_words(site("log: log.csv\n  energy_ratio: 60 %", "log.csv", text).derived)
    assert words.count("not used: N60, Recovery, Note;") == 1
    assert words.endswith("2 rows without a depth or a reading left out")
    assert words.startswith("soil: log.csv, hole B; friction angle")


def test_letters_of_any_encoding_cost_no_number(site):
    text = ags_counts({"BH1": COUNTS}).replace("made up", "Größe 5° m²").encode("latin-1")
    assert readings_of(site("log: log.ags", "log.ags", text), "n") == COUNTS
    assert readings_of(site("log: log.csv", "log.csv", "\ufeff" + table("Depth (m),N60", COUNTS)), "n") == COUNTS


def test_a_hole_that_stands_twice_in_a_file_is_one(site):
    once, twice = (site("log: log.ags", "log.ags", ags_counts({"BH1": COUNTS}) * times) for times in (1, 2))
    assert readings_of(twice, "n") == sorted(COUNTS * 2)
    assert twice.constants == once.constants
    assert twice.distributions == once.distributions


# --- Holes ---

HOLES = {
    "holes.csv": "BH,Depth (m),N\nA,0.5,17\nB 2,0.5,25\nA,1.2,18\nB 2,1.2,30\n",
    "holes.ags": ags_counts({"A": [(0.5, 17), (1.2, 18)], "B 2": [(0.5, 25), (1.2, 30)]}, ratio=""),
}


@pytest.mark.parametrize("name", HOLES)
def test_a_hole_is_named_where_there_are_several(site, refusal, name):
    sweep = site(f"log: {name}\n  hole: B 2\n  energy_ratio: 60 %", name, HOLES[name])
    assert readings_of(sweep, "n") == [(0.5, 25), (1.2, 30)]
    assert "has 2 holes; name one as hole: A, B 2" in refusal(name, HOLES[name]).message
    problem = refusal(name, HOLES[name], "log: FILE\n  hole: b2")
    assert "'b2' is not a hole of" in problem.message
    assert "(A, B 2); did you mean B 2?" in problem.message
    assert (problem.line, problem.column) == (6, 9)


def test_a_cone_counts_before_the_counts_of_the_same_hole(site):
    text = ags_counts({"A": COUNTS}) + "\r\n" + ags_cone({"A": CONE})
    sweep = site("log: both.ags", "both.ags", text)
    assert log_of(sweep)["method"] == "cpt"
    assert "not used: blow counts" in derived_words(sweep.derived)[0]


# --- The soil that follows ---


@given(st.integers(10, 40), st.permutations([0.3, 0.6, 0.9, 1.2, 1.5]))
def test_a_log_of_uniform_soil_gives_what_its_readings_give(tmp_path_factory, n, depths):
    """Down to 1.5 m the normalization is at its limit, so equal counts are equal (N1)60."""
    folder = tmp_path_factory.mktemp("uniform")
    written(folder, "log.csv", table("Depth (m),N", [(z, n) for z in depths]))
    by_hand = ", ".join(f"{{n: {n}, energy_ratio: 60 %, depth: {z} m}}" for z in depths)
    log = load_text(f"{SITE}  log: log.csv\n  energy_ratio: 60 %\n", folder / "grid.yaml")
    spt = load_text(f"{SITE}  spt: [{by_hand}]\n", folder / "grid.yaml")
    assert not log.model.ground.layers
    assert log.correlation == spt.correlation
    for name in (ANGLE, REACTION):
        assert log.constants[name] == pytest.approx(spt.constants[name], rel=1e-12)
        (mine, theirs) = (sweep.distributions[name].deviation([1.0])[0] for sweep in (log, spt))
        assert mine == pytest.approx(theirs, rel=1e-12)
    assert log.distributions[DENSITY] == spt.distributions[DENSITY]


def test_a_cone_in_uniform_soil_gives_what_its_readings_give(site):
    """Readings a window apart are taken as they are; near the surface the angle does not depend on the depth."""
    pairs = [(0.125 + 0.25 * at, 9.0) for at in range(5)]
    log = site("log: log.gef", "log.gef", gef(pairs))
    cpt = site("cpt: [" + ", ".join(f"{{q_c: {q} MPa, depth: {z} m}}" for z, q in pairs) + "]")
    assert log.constants[ANGLE] == pytest.approx(cpt.constants[ANGLE], rel=1e-12)
    assert log.distributions[ANGLE] == cpt.distributions[ANGLE]


def reading(depth, angle):
    return {"depth_m": depth, "friction_angle_deg": angle, "friction_angles_deg": {"a": angle, "b": angle + 2.0}}


def test_a_layer_has_the_mean_weighted_by_depth_and_its_scatter():
    """By hand: boundaries 0, 1, 2 and 3 m, so weights of 1, 3 and 5."""
    (layer,) = layers_of([reading(0.5, 34.0), reading(1.5, 36.0), reading(2.5, 35.0)], 3.0, 3.0, is_cone=False)
    mean = (34.0 + 3 * 36.0 + 5 * 35.0) / 9.0
    assert layer.angles == pytest.approx({"a": mean, "b": mean + 2.0})
    variance = ((34.0 - mean) ** 2 + 3 * (36.0 - mean) ** 2 + 5 * (35.0 - mean) ** 2) / 9.0 * 3.0 / 2.0
    assert layer.scatter_deg == pytest.approx((variance / 3.0) ** 0.5)  # one independent reading a metre
    assert (layer.from_m, layer.to_m, layer.readings) == (0.0, 3.0, 3)


@pytest.mark.parametrize(("below", "weight"), [(36.5, 0.5 * (2.2**2 - 2.0**2)), (35.5, 0.5 * (2.95**2 - 2.0**2))])
def test_a_reading_below_the_foot_adds_no_strength(below, weight):
    """Its share above the foot counts where it is stronger than the one above, all of it where it is weaker."""
    (layer,) = layers_of([reading(0.5, 34.0), reading(1.5, 36.0), reading(2.5, below)], 2.2, 3.0, is_cone=False)
    assert layer.angles["a"] == pytest.approx((0.5 * 34.0 + 1.5 * 36.0 + weight * below) / (2.0 + weight))


@pytest.mark.parametrize(
    ("angles", "tops"),
    [
        ([34, 35, 34, 35, 34, 35], [0.0]),
        ([31, 31, 31, 38, 38, 38], [0.0, 1.75]),  # the weaker soil reaches up to the stronger reading
        ([38, 38, 38, 31, 31, 31], [0.0, 1.25]),
        ([38, 38, 31, 31, 38, 38], [0.0, 0.75, 2.25]),  # a weak layer in between, which no two halves show
        ([31, 31, 38, 31, 31, 31], [0.0]),  # a single strong reading counts for nothing
        ([31, 34.5, 38, 41.5, 45, 45], [0.0, 0.75, 1.25, 1.75, 2.25]),
    ],
)
def test_layers_are_parted_where_they_differ_by_more_than_the_scatter(angles, tops):
    rows = [reading(0.25 + 0.5 * at, float(angle)) for at, angle in enumerate(angles)]
    layers = layers_of(rows, 2.9, 3.0, is_cone=False)
    assert [layer.from_m for layer in layers] == tops
    assert [layer.to_m for layer in layers] == [*tops[1:], 2.75 + 0.45]


def test_of_two_readings_at_one_depth_the_weaker_counts():
    rows = [reading(0.5, 36.0), reading(1.0, 37.0), reading(1.0, 36.0), reading(1.0, 38.0), reading(1.5, 36.0)]
    for order in (rows, rows[::-1]):
        (layer,) = layers_of(order, 2.0, 3.0, is_cone=False)
        assert (layer.readings, layer.scatter_deg) == (3, pytest.approx(0.0, abs=1e-6))
        assert layer.angles["a"] == pytest.approx(36.0)


def test_there_are_no_more_layers_than_are_simulated_side_by_side():
    rows = [reading(1.0 + at, 4.0 * at) for at in range(12)]
    assert len(layers_of(rows, 12.0, 3.0, is_cone=False)) == 8


def test_the_weakest_counts_of_few_readings():
    (layer,) = layers_of([reading(0.5, 36.0), reading(1.5, 34.0)], 2.0, 3.0, is_cone=False)
    assert layer.readings < FEWEST
    assert (layer.angles["a"], layer.scatter_deg) == (34.0, 0.0)


def test_a_refusal_between_weaker_counts_is_left_out_and_said_once(site):
    text = FILES["plain.csv"].replace(f"{COUNTS[1][0]},{COUNTS[1][1]}\n", f"{COUNTS[1][0]},50/75mm\n")
    data = log_of(site("log: log.csv\n  energy_ratio: 60 %", "log.csv", text))
    assert [one["depth_m"] for one in data["readings"] if one.get("left_out") == HARD_SPOT] == [COUNTS[1][0]]
    assert data["layers"][0]["readings"] == len(COUNTS) - 1
    words = soil_words(data)
    assert f"1 reading at {COUNTS[1][0]:g} m left out, a hard spot between weaker ones" in words
    assert "taken as its end" not in words
    assert max(map(len, log_lines(data))) <= 80


_WATER_TABLE = (("GROUP", "WSTG"), ("HEADING", "LOCA_ID", "WSTG_DPTH"), ("DATA", "BH1", "0.9"), ("DATA", "B2", "0.1"))
WATER = {
    "water.gef": gef(CONE).replace("#EOH", "#MEASUREMENTVAR = 14, 0.90, m, grondwaterstand\n#EOH"),
    "water.ags": ags_counts({"BH1": COUNTS}) + "\n".join(",".join(f'"{c}"' for c in row) for row in _WATER_TABLE),
}


@pytest.mark.parametrize("name", WATER)
def test_ground_water_is_said_until_the_file_gives_a_water_table(site, name):
    (words,) = derived_words(site(f"log: {name}", name, WATER[name]).derived)
    assert f"ground water at 0.9 m in {name} is not used; give soil.water_table and soil.subgrade_reaction" in words
    wet = site(f"log: {name}\n  water_table: 0.9 m\n  subgrade_reaction: 20 MN/m^3", name, WATER[name])
    assert wet.model.ground.water_table_m == 0.9
    assert "ground water" not in derived_words(wet.derived)[0]
    (words,) = derived_words(site(f"log: {name}", name, WATER[name].replace("0.9", "3.9")).derived)
    assert "ground water" not in words  # below every foot


def test_a_thin_seam_of_a_cone_is_no_layer():
    rows = [reading(WINDOW_M * (at + 0.5), 31.0 if at == 4 else 38.0) for at in range(12)]
    assert len(layers_of(rows, 2.5, 2.8, is_cone=True)) == 1
    rows = [reading(WINDOW_M * (at + 0.5), 31.0 if at in (4, 5) else 38.0) for at in range(12)]
    assert [layer.from_m for layer in layers_of(rows, 2.5, 2.8, is_cone=True)] == [0.0, 1.0, 1.5]


@pytest.mark.parametrize("embedment", ["[1.2, 2.0, 2.9] m", "to be found", "{mean: 2.0 m, sd: 0.2 m}"])
def test_no_boulder_is_judged_in_soil_that_only_a_deeper_foot_reaches(site, embedment):
    """Counts that grow with the depth, by less than the scatter from one to the next."""
    log = (
        "log: log.csv\n  energy_ratio: 60 %",
        "log.csv",
        table("Depth (m),N", [(0.3 * k, 14 + k) for k in range(2, 13)]),
    )
    whole = site(*log, f"site.embedment_depth={embedment}")
    for depth in (1.2, 1.6, 2.0, 2.4, 2.9):
        alone = site(*log, f"site.embedment_depth={depth} m")
        assert whole.constants[ANGLE] <= alone.constants[ANGLE] + 1e-9
    assert whole.constants[ANGLE] < alone.constants[ANGLE] - 0.1


@given(st.lists(st.tuples(st.floats(0, 30), st.floats(28, 46)), min_size=1, max_size=40), st.floats(0.1, 10))
def test_layers_fill_the_depth_and_stay_within_the_readings(pairs, foot):
    layers = layers_of([reading(z, angle) for z, angle in pairs], foot, 3.0, is_cone=False)
    assert layers[0].from_m == 0.0
    assert all(upper.to_m == lower.from_m for upper, lower in pairwise(layers))
    assert layers[-1].to_m >= foot
    low, high = min(angle for _, angle in pairs), max(angle for _, angle in pairs)
    assert all(low - 1e-9 <= layer.angles["a"] <= high + 1e-9 for layer in layers)
    assert len(layers) <= 8


WEAK_BELOW = [(0.3, 28), (0.6, 29), (0.9, 28), (1.2, 12), (1.5, 13), (1.8, 12), (2.1, 13), (9.0, 4)]


def test_scatter_and_correlation_make_the_spread_and_the_note_names_both(site):
    sweep = site("log: log.csv\n  energy_ratio: 60 %", "log.csv", table("Depth (m),N", COUNTS))
    data = log_of(sweep)
    whole = np.hypot(data["correlation_sd_deg"], data["scatter_sd_deg"])
    assert data["scatter_sd_deg"] > 0.1
    assert sweep.distributions[ANGLE].sd == pytest.approx(whole, abs=0.01)
    assert sweep.distributions[ANGLE].sd >= whole
    (words,) = derived_words(sweep.derived)
    assert f"sd {data['correlation_sd_deg']:.3g} deg of the correlation with {data['scatter_sd_deg']:.2g} deg" in words


def test_deeper_layers_have_what_5_percent_fall_below(site):
    sweep = site("log: log.csv\n  energy_ratio: 60 %", "log.csv", table("Depth (m),N", WEAK_BELOW))
    (layer,) = sweep.model.ground.layers
    upper, deeper = log_of(sweep)["layers"]
    assert layer.from_m == deeper["from_m"] == 0.9  # up to the last strong reading
    assert layer.friction_angle_deg == pytest.approx(
        deeper["friction_angle_deg"] - 1.6449 * deeper["friction_angle_sd_deg"], abs=1e-3
    )
    low, high = sand.densities(deeper["friction_angle_deg"])
    assert layer.density_kg_m3 == pytest.approx(low + 0.05 * (high - low))
    assert layer.subgrade_reaction_MN_m3 < 0.5 * deeper["subgrade_reaction_MN_m3"]
    assert sweep.constants[ANGLE] == upper["friction_angle_deg"] > deeper["friction_angle_deg"] + 3.0
    (words,) = derived_words(sweep.derived)
    assert "below 0.9 m the 5 % of each," in words
    assert "1 reading at 9 m left out, below the first one under the deepest foot (2 m)" in words
    assert "ft" in derived_words(sweep.derived, "us")[0]


BELOW_IT = "layers: [{from: 3 m, density: 2000, friction_angle: 36, subgrade_reaction: 40}]"


@pytest.mark.parametrize(
    "given_too", ["subgrade_reaction: 40 MN/m^3", "friction_angle: 36", "density: [1800, 1900]", BELOW_IT]
)
def test_where_there_can_be_no_layers_the_weakest_stands_for_all_depths(site, given_too):
    sweep = site(f"log: log.csv\n  energy_ratio: 60 %\n  {given_too}", "log.csv", table("Depth (m),N", WEAK_BELOW))
    assert len(sweep.model.ground.layers) == int(given_too == BELOW_IT)
    data = log_of(sweep)
    assert data["weakest_layer"] == 1
    if given_too != "friction_angle: 36":
        assert sweep.constants[ANGLE] == data["layers"][1]["friction_angle_deg"]
    assert "the weakest of 2 layers stands for all depths" in derived_words(sweep.derived)[0]


def test_named_soils_may_each_have_a_log(site):
    soils = "- {name: a, log: log.csv, energy_ratio: 60 %}\n  - {name: b, log: log.csv, energy_ratio: 80 %}"
    sweep = site(soils, "log.csv", table("Depth (m),N", WEAK_BELOW))
    assert [data["name"] for data in sweep.derived["soil"]] == ["a", "b"]
    assert not sweep.model.ground.layers


def test_a_given_density_is_that_of_every_layer(site):
    text = table("Depth (m),N", WEAK_BELOW)
    sweep = site("log: log.csv\n  energy_ratio: 60 %\n  density: 1850 kg/m^3", "log.csv", text)
    assert [layer.density_kg_m3 for layer in sweep.model.ground.layers] == pytest.approx([1850.0])


def test_what_the_file_gives_wins(site):
    given_all = "friction_angle: 38\n  density: 1900\n  subgrade_reaction: 60"
    sweep = site(f"log: log.csv\n  energy_ratio: 60 %\n  {given_all}", "log.csv", table("Depth (m),N", WEAK_BELOW))
    assert sweep.constants[ANGLE] == 38.0
    assert not sweep.distributions
    assert "kept for the record" in derived_words(sweep.derived)[0]
    assert len(log_lines(log_of(sweep))) > 5


def test_topsoil_is_left_out_and_does_not_mix_with_what_is_below(site):
    pairs = [(0.05 * at, 0.5 if at <= 6 else 9.0) for at in range(1, 60)]
    sweep = site("log: log.csv\n  topsoil: 0.31 m", "log.csv", table("Depth (m),qc (MPa)", pairs))
    readings = log_of(sweep)["readings"]
    assert [one["q_c_MPa"] for one in readings if one.get("left_out") == IN_TOPSOIL] == [0.5, 0.5]
    assert {one["q_c_MPa"] for one in readings if "left_out" not in one} == {9.0}


def test_a_search_deeper_than_the_log_counts_is_refused(site):
    sweep = site("log: log.csv\n  energy_ratio: 60 %", "log.csv", table("Depth (m),N", [*COUNTS, (9.0, 30)]))
    assert covered_depth(sweep.derived) == 2.2
    assert [one.get("left_out") for one in log_of(sweep)["readings"]] == [None] * 4 + [BELOW_FOOT]
    with pytest.raises(QuestionError, match=r"readings of the soil below 2\.2 m were left out"):
        need(sweep, "embedment_depth")


def test_what_a_log_does_not_reach_is_said(site):
    sweep = site("log: log.csv\n  energy_ratio: 60 %", "log.csv", table("Depth (m),N", [(1.2, 20), (1.7, 20)]))
    (words,) = derived_words(sweep.derived)
    assert "begins at 1.2 m; its first reading stands for the soil above" in words
    assert "ends at 1.7 m; its last reading stands for the soil down to the foot" in words
    sweep = site("log: log.csv\n  energy_ratio: 60 %", "log.csv", table("Depth (m),N", COUNTS))
    assert "stands for the soil" not in derived_words(sweep.derived)[0]


# --- Refusals ---

CUT = gef(CONE)[: gef(CONE).rindex("0.02")]


@pytest.mark.parametrize(
    ("name", "text", "words", "line"),
    [
        ("log.doc", "x", "has an unsupported type; use .csv, .xlsx, .ags, .gef, .xml", 5),
        ("log.csv", "", "is empty", 5),
        ("log.csv", b"\xff\xfe\x00\x01", "is not UTF-8 text", 5),
        ("log.csv", "Depth (m),N\n", "has no rows with a depth and a reading", 5),
        ("log.csv", "Depth,N\n1,20\n", "the unit is missing; write Depth (m) or Depth (ft)", 1),
        ("log.csv", "Depth (m),qc\n1,20\n", "the unit is missing; write qc (MPa) or qc (tsf)", 1),
        ("log.csv", "Depth (m),qc (kN)\n1,20\n", "q_c: ", 1),
        ("log.csv", "Depth (m),Blows (per 100 mm)\n1,20\n", "needs a column of depth and one of N or q_c", 1),
        ("log.csv", "z (m),N\n1,20\n", "needs a column of depth and one of N or q_c", 1),  # may be an elevation
        ("log.csv", "Tiefe (m),N\n1,20\n", "needs a column of depth and one of N or q_c", 1),
        ("log.csv", "Depth (m),N60\n1,abc\n", "'abc' is not a number", 2),
        ("log.csv", "Depth (m),N60\n1,5-6\n", "'5-6'", 2),
        ("log.csv", "Depth (m),N60\n1,nan\n", "'nan' is not a finite number", 2),
        ("log.csv", "Depth (m),N60\n-1,20\n", "depth: -1 m is outside the admitted range", 2),
        ("log.csv", "Depth (m),qc (MPa)\n1,9\n2,-999.99\n", "q_c: -999.99 MPa is outside the admitted range", 3),
        ("log.csv", "Depth (m),qc (kPa)\n1,9000\n2,9e6\n", "q_c: 9000 MPa is outside", 3),
        ("log.gef", gef([(0.5, 9), (1e9, 9)]), "depth: 1e+09 m is outside", 14),
        ("log.csv", "Depth (m),N60\nx,20\n", "depth: 'x' is not a number", 2),
        ("log.csv", "Depth (m),N60\n1,2000\n", "n60: 2000 is outside", 2),
        ("log.csv", "Depth (m),N60\n1,20,3\n", "has 3 cells", 2),
        ("log.csv", "Depth (m),N\n1,20\n", "does not give the energy ratio of the hammer for every count", 5),
        ("log.ags", "hello", "has no rows with a depth and a reading", 5),
        ("log.ags", '"**ISPT"\n"*HOLE_ID"\n', "is AGS 3", 5),
        ("log.ags", '"GROUP","ISPT"\n"HEADING","LOCA_ID","ISPT_TOP"\n"DATA","B"\n', "has 2 cells", 3),
        ("log.ags", '"GROUP","ISPT"\n"DATA","B","1"\n', "has 3 cells; the headings of ISPT are 0", 2),
        ("log.ags", ags_counts({"A": COUNTS}, unit="furlong"), "depth: ", 21),
        ("log.ags", ags_counts({"A": COUNTS}).replace('"0.5"', '"x"'), "depth: 'x' is not a number", 23),
        ("log.ags", b"\x00\x01", "is not a text file", 5),
        ("log.gef", "hello", "is not a GEF file", 5),
        ("log.gef", gef(CONE).replace(", 2\r", ", 5\r"), "has no columns", 5),
        ("log.gef", gef([(0.5, "abc")]), "q_c: 'abc' is not a number", 13),
        ("log.gef", gef([(0.5, "nan")]), "q_c: 'nan' is not a number", 13),
        ("log.gef", CUT, "has 2 cells; the header names more", 1 + CUT.count("\n")),
        ("log.xml", "<a", "cannot be read as XML", 5),
        ("log.xml", "<a/>", "is no cone log of the BRO", 5),
        ("log.xml", '<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "has definitions of its own", 5),
        ("log.xml", bro(CONE).replace("coneResistance>ja", "coneResistance>nee"), "has no depth, or no cone", 5),
        ("log.xml", bro(CONE).replace(",9.5,", ","), "has 4 values in a row; 5 are declared", 1),
    ],
)
def test_files_that_cannot_be_read_say_why(refusal, name, text, words, line):
    problem = refusal(name, text)
    assert words in str(problem)
    assert line in (None, problem.line)


@pytest.mark.parametrize(
    ("soil", "words"),
    [
        ("hole: A\n  friction_angle: 38", "hole goes with soil.log"),
        ("log: nothing.csv", "there is no such file"),
        ("log: [a.csv]", "must be the name of a file"),
        ("log: log.csv\n  hole: [1]", "must be the name of a hole"),
        ("log: log.csv\n  spt: {n1_60: 20}", "give one of"),
        ("log: log.csv\n  energy_ratio: 60 %", "gives q_c, which needs no energy ratio"),
    ],
)
def test_entries_that_do_not_fit_are_refused(site, soil, words):
    with pytest.raises(SettingsError, match=words.replace(".", r"\.")):
        site(soil, "log.csv", table("Depth (m),qc (MPa)", CONE))


def test_weak_soil_is_refused_in_one_line(refusal):
    """Three real cone logs gave 56 to 441 lines, reading by reading."""
    soft = [(z, 0.4 if 0.5 < z < 1.4 else q) for z, q in CONE]
    problem = refusal("log.gef", gef(soft))
    assert "are too weak for it, at 0.63 to 1.37 m" in problem.message or "too weak for it, at" in problem.message
    assert problem.message.endswith("give soil.friction_angle, soil.density and soil.subgrade_reaction as measured")
    loose_top = refusal("log.gef", gef([(z, 0.4 if z < 0.2 else q) for z, q in CONE]))
    assert "or, where this is topsoil, soil.topsoil:" in loose_top.message


def test_voids_of_a_cone_are_left_out(site):
    rows = [(z, "-9999" if at % 5 == 0 else q) for at, (z, q) in enumerate(CONE)]
    sweep = site("log: log.gef", "log.gef", gef(rows))
    assert min(one["q_c_MPa"] for one in log_of(sweep)["readings"]) >= 9.0
    assert "80 rows without a depth or a reading left out" in derived_words(sweep.derived)[0]
    rows = [(z, "-999999" if at % 5 == 0 else q) for at, (z, q) in enumerate(CONE)]
    assert readings_of(site("log: log.xml", "log.xml", bro(rows)), "q_c_MPa") == readings_of(sweep, "q_c_MPa")


def test_every_reading_that_is_wrong_is_named_once(site):
    text = table("Depth (m),N60", [(0.5, "abc"), (0.6, "abc"), (0.7, 5000), (0.8, 20)])
    with pytest.raises(SettingsError) as caught:
        site("log: log.csv", "log.csv", text)
    problems = caught.value.problems
    assert [(one.file[-7:], one.line, one.column) for one in problems] == [("log.csv", 2, 5), ("log.csv", 4, 5)]


def test_sizes_are_capped(site, refusal, monkeypatch):
    monkeypatch.setattr("boulder_sweep.settings.logs.MOST_READINGS", 10)
    assert "more than 10 readings of a hole" in refusal("log.gef", gef(CONE)).message
    monkeypatch.setattr("boulder_sweep.settings.logs.MOST_BYTES", 100)
    assert "at most 0.0001 MB is read" in refusal("log.gef", gef(CONE)).message


# --- The drawing ---


def test_a_log_is_drawn_in_few_lines_of_plain_characters(site):
    sweep = site("log: log.gef", "log.gef", gef(CONE))
    lines = log_lines(log_of(sweep))
    assert len(lines) <= 30
    assert all(line.isascii() and len(line) <= 80 for line in lines)
    (foot,) = (at for at, line in enumerate(lines) if line.startswith("=== deepest foot of a boulder, 2 m"))
    depths = [float(line.split()[0]) for line in lines[2:] if line[:1] == " "]
    assert depths == sorted(depths)
    assert float(lines[foot - 1].split()[0]) < 2.0 < float(lines[foot + 1].split()[0])
    assert lines[-1] == "23 deeper readings left out"
