"""All mistakes of a file at once, each at its place, each once."""

import pickle
import subprocess
import sys

import pytest

from boulder_sweep.settings import SettingsError
from boulder_sweep.settings.problems import MAX_REPORTED

TEN_MISTAKES = """\
name: ten mistakes
boulder:
  lenght: 1.65 m
  width: -1.68 m
  height: {from: 3.4 m, to: 1.6 m, step: 0.1 m}
  density: 2596 kg/m^2
site:
  embedment_ratio: [0.4, 0.5, .nan]
soil:
  density: 1859.9 kg/m^3
  friction_angle: []
  subgrade_reaction: no
  strain_rate_factor: 010
vehicle:
  mass: 7 ton
  speed: 30 mph
  speed: 31 mph
  spring: 3103.3 kN/m
  damper: 138.91 kN*s/m
criterion: {rating: P4}
"""

EXPECTED = [
    (3, 3, "boulder.lenght", "did you mean length?"),
    (4, 10, "boulder.width", "-1.68 m is outside the admitted range of 0.01 to 20 m"),
    (5, 42, "boulder.height", "goes downwards and the step does not"),
    (6, 12, "boulder.density", "a density is needed (kg/m^3, t/m^3, pcf or kN/m^3)"),
    (8, 31, "site.embedment_ratio", "'.nan' is not a finite number"),
    (11, 19, "soil.friction_angle", "the list is empty"),
    (12, 22, "soil.subgrade_reaction", "yes/no value"),
    (13, 23, "soil.strain_rate_factor", "begins with a zero"),
    (15, 9, "vehicle.mass", "short_ton, long_ton or tonne"),
    (17, 3, "vehicle.speed", "is given twice (first on line 16)"),
    (20, 21, "criterion.rating", "P1, P2, P3"),
]


def test_every_mistake_at_once_with_line_and_column(problems_of):
    problems = problems_of(TEN_MISTAKES)
    assert [(p.line, p.column, p.key) for p in problems] == [mistake[:3] for mistake in EXPECTED]
    for problem, (line, column, key, words) in zip(problems, EXPECTED, strict=True):
        assert words in problem.message
        assert str(problem) == f"grid.yaml:{line}:{column}: {key}: {problem.message}"


def test_the_error_reads_as_one_line_per_problem(load_it):
    with pytest.raises(SettingsError) as caught:
        load_it(TEN_MISTAKES)
    assert str(caught.value).splitlines() == [str(problem) for problem in caught.value.problems]
    again = pickle.loads(pickle.dumps(caught.value))
    assert again.problems == caught.value.problems


def test_on_the_command_line_without_anything_heavy(tmp_path):
    path = tmp_path / "ten.yaml"
    path.write_text(TEN_MISTAKES)
    code = (
        "import sys\n"
        "from boulder_sweep.cli.main import execute\n"
        f"code = execute(['check', {str(path)!r}])\n"
        "heavy = {'numba', 'pandas', 'scipy', 'pyarrow', 'matplotlib', 'joblib', 'pint', 'dask'} & set(sys.modules)\n"
        "print(code, sorted(heavy))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "2 []\n"
    lines = done.stderr.splitlines()
    assert len(lines) == len(EXPECTED)
    for line, (row, column, key, words) in zip(lines, EXPECTED, strict=True):
        assert line.startswith(f"{path}:{row}:{column}: {key}: ")
        assert words in line


@pytest.mark.parametrize(
    ("key", "hint"),
    [
        ("boulder.hieght", "did you mean height?"),
        ("soil.phi", "did you mean friction_angle?"),
        ("soil.beta", "did you mean subgrade_reaction?"),
        ("soil.unit_weight", "did you mean density?"),
        ("boulder.length_ft", "did you mean length: 1 ft?"),
        ("vehicle.spring_kN_m", "did you mean spring: 1 kN/m?"),
        ("vehicle.k_v", "did you mean spring?"),
        ("vehicle.bumper", "did you mean bumper_height?"),
        ("vehicle.hood", "did you mean hood_height?"),
        ("soil.speed", "speed belongs under vehicle"),
        ("vehicel", "did you mean vehicle?"),
        ("modle", "did you mean model?"),
        ("solver.acuracy", "did you mean accuracy?"),
        ("xyzzy", "is not an entry of the file (length, width, "),
    ],
)
def test_unknown_keys_are_told_with_what_was_meant(the_problem, key, hint):
    problem = the_problem(f"{key}=1")
    assert problem.key == key
    assert hint in problem.message


@pytest.mark.parametrize(
    "override",
    [
        "vehicle.mas=30 mph",
        "soil.modulus=30 MPa",
        "soil.spt={n2_60: 20}",
        "soil.spt={n70: 20}",
        "soil.cpt={q_t: 14 MPa}",
    ],
)
def test_no_key_of_another_meaning_is_suggested(problems_of, minimal, override):
    assert "did you mean" not in str(problems_of(minimal, override))


@pytest.mark.parametrize(
    ("old", "new", "key", "place", "words"),
    [
        ("width:", "widht:", "boulder.widht", (3, 3), ""),  # and is not missing too
        ("vehicle:", "vehicel:", "vehicel", (12, 1), ""),
        ("embedment_depth:", "embedment:", "site.embedment", (7, 3), ""),
        ("site:\n", "site:\n  embedment_ratio: 0.5\n", "site.embedment_depth", (8, 3), "not both"),
        ("site:\n  embedment_depth: 2.03\n", "", "site", (1, 1), ""),
        ("  embedment_depth: 2.03", "  impact_height: 0.9", "site", (6, 1), ""),
        ("boulder:\n", "solver: {accuracy: fine, step: 1 ms}\nboulder:\n", "solver.step", (1, 26), "not both"),
        (
            "boulder:\n",
            "solver: fast\nboulder:\n",
            "solver",
            (1, 9),
            "a block of keys: accuracy, step, horizon",
        ),
    ],
)
def test_a_mistake_is_told_once_at_its_key(problems_of, minimal, old, new, key, place, words):
    problem, *others = problems_of(minimal.replace(old, new, 1))
    assert (problem.key, problem.line, problem.column) == (key, *place)
    assert words in problem.message
    assert not others


@pytest.mark.parametrize(
    ("overrides", "key"),
    [
        (["vehicle.hood_height=0.3"], "vehicle.hood_height"),
        (["vehicle.bumper_height=1.5 m"], "vehicle.bumper_height"),
        (["vehicle.bumper_height=0.9", "vehicle.hood_height=0.8", "site.impact_height=0.9"], "vehicle.hood_height"),
    ],
)
def test_a_hood_below_the_bumper_is_refused(problems_of, minimal, overrides, key):
    (problem,) = problems_of(minimal, *overrides)
    assert problem.key == key
    assert "lower than the bumper" in problem.message


def test_a_hood_below_the_bumper_is_found_beside_other_mistakes(problems_of, minimal):
    problems = problems_of(minimal, "vehicle.hood_height=0.3", "vehicle.spring=x", "vehicle.wheels=4")
    assert {problem.key for problem in problems} == {"vehicle.hood_height", "vehicle.spring", "vehicle.wheels"}


def test_an_impact_above_the_boulder_is_refused(the_problem, load_with):
    problem = the_problem("site.impact_height=1.5")
    assert "above the top of the boulder, which stands 1.41 m out of the ground" in problem.message
    assert load_with("site.impact_height=1.41 m").block(0, 1).reasons[0] == ""


def test_an_emptied_block_takes_its_defaults(load_it, minimal):
    sweep = load_it(minimal + "criterion:\n#  rating: P2\nsolver:\n")
    assert sweep.criterion.rating == "P1"


def test_a_list_of_mistakes_has_an_end(problems_of, minimal):
    text = minimal + "".join(f"key{i}: 1\n" for i in range(10 * MAX_REPORTED))
    problems = problems_of(text)
    assert len(problems) == MAX_REPORTED + 1
    assert str(problems[-1]) == f"grid.yaml: and {9 * MAX_REPORTED} more problems"


def test_a_long_word_is_shortened(the_problem):
    assert len(str(the_problem("boulder.height=" + "x" * 10_000))) < 300
