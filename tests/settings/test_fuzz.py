"""Whatever stands in a good file, loading ends in a sweep or in problems with their positions: never in a traceback.

`tests.fuzz` tries any bytes.
"""

import re
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from boulder_sweep.settings import Problem, SettingsError, Sweep, load_text
from boulder_sweep.settings.units import EXPECTED, UnitError, factor

ROOT = Path(__file__).parents[2]
FILES = [path.read_text() for path in sorted((ROOT / "configs").glob("*.yaml")) if "crash" not in path.name]
FLOW = (
    "boulder: {length: 1.65 m, width: 1.68 m, height: {from: 1.6 m, to: 3.4 m, count: 19}, density: 2596}\n"
    "site: {embedment_ratio: {from: 0.40, to: 0.70, step: 0.02}, impact_height: 0.9}\n"
    "soil: {density: &d 1859.9 kg/m^3, friction_angle: [36, 43.2] deg, subgrade_reaction: '[25, 95] MN/m^3'}\n"
    "vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}\n"
    "model: {readings: {preset: corrected, inertia: printed}, soil: {elements: 50}}\n"
    "solver: {step: 4 ms, horizon: 1 s}\n"
)
UNCERTAIN = (
    "boulder: {length: 1.65 m, width: 1.68 m, height: {mean: [2 m, 3 m], cov: 5 %}, density: 2596}\n"
    "site: {embedment_depth: {distribution: triangular, low: 1 m, mode: 1.5 m, high: 1.9 m}}\n"
    "soil:\n  - {name: a, density: 1700, friction_angle: 32, subgrade_reaction: 10}\n"
    "  - {name: b, density: 1900, friction_angle: 42, subgrade_reaction: 80}\n"
    "vehicle: {mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, "
    "damper: {characteristic: 138.91 kN*s/m, sd: 5 kN*s/m}}\n"
    "partial_factor: {friction_angle: 1.25}\n"
)
SCRAPS = [
    *"[]{}:,#&*!|>'\"%@`-?~\t\n \\",
    *("[" * 30, "{a: ", ": ", "- ", "<<: *d", "*d", "&d", "!!python/name:x ", "!x "),
    *("no", "1:30", "010", ".nan", "-.inf", "1e999", "1e-999", "-1", "0", "1e308", "null", "true", "''", '""'),
    *("---\n", "...\n", "%YAML 1.1\n", "\ufeff", "\x00", "\x85", "\u2028", "\U0001f4a9", "é", "°", "³", "·", "−", "１"),
    *("m^9^9", "ton", " deg", " m", "kN*s/m", "from: 1", "to: 2", "count: 0", "step: 0", "count: 1000000", "from:"),
    *("{mean: 1, sd: 1}", "{distribution: beta", "mean: [1, 2]", "cov: 5 %", "low: 1", "high: 2"),
    *("[{name: a, ", "- name: b\n"),
    *("{from: 1, to: 2, count: 3}", "table: x.csv\n", "table: /dev/zero\n", "name: ../x\n"),
    *("\\ud800", '"\\ud800"', '"\\UFFFFFFFF"', "9" * 50, "a" * 200),
]


def attempt(text: str, *overrides: str) -> tuple[Sweep | None, list[Problem]]:
    """Return what a text loads to, or what is wrong with it; anything else that is raised is a failure."""
    try:
        return load_text(text, Path("grid.yaml"), overrides), []
    except SettingsError as error:
        return None, error.problems


def loads_or_says_why(text: str, *overrides: str) -> None:
    """Load a text; it must end in a sweep that gives blocks, or in problems fit to be read."""
    sweep, problems = attempt(text, *overrides)
    if sweep is None:
        assert problems
        for problem in problems:
            assert problem.message
            assert "\n" not in str(problem)
            assert len(problem.message) < 700
            str(problem).encode()  # fit to be printed
    else:
        assert sweep.n_designs >= 1
        if sweep.depth_sought:
            return
        last = sweep.block(sweep.n_designs - 1, sweep.n_designs)
        assert all(column.to_numpy().shape == (1,) for column in last.columns.values())


@st.composite
def mutated(draw: st.DrawFn) -> str:
    """Return a good file with some places overwritten, removed or repeated."""
    text = draw(st.sampled_from([*FILES, FLOW, UNCERTAIN]))
    for _ in range(draw(st.integers(1, 6))):
        start = draw(st.integers(0, len(text)))
        stop = min(len(text), start + draw(st.sampled_from([0, 0, 1, 1, 2, 5, 20, 100])))
        filling = draw(
            st.one_of(st.sampled_from(SCRAPS), st.text(max_size=5), st.just(text[start:stop] * 2), st.just(""))
        )
        text = text[:start] + filling + text[stop:]
    return text


QUICK = settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))


@QUICK
@given(text=mutated())
@example(text="? ")
@example(text="a: |\n  [1] deg")
@example(text="boulder: {height: [1] m ] m}")
@example(text='boulder: {height: "\\ud800"}')
def test_mutated_files(text: str) -> None:
    loads_or_says_why(text)


@QUICK
@given(
    key=st.sampled_from(
        ["boulder.height", "model.readings", "soil", "table", "name", "solver.step.x", "criterion.rating"]
    ),
    value=st.one_of(st.text(max_size=20), st.lists(st.sampled_from(SCRAPS), max_size=8).map("".join)),
)
def test_any_override(key: str, value: str) -> None:
    loads_or_says_why(FLOW, f"{key}={value}")


UNIT_SIGNS = [
    *("m", "kN", "s", "lb", "/", "*", "^", "**", "-", "(", ")", "3", "-2", " ", "per", "ft", "°", "%", "ton", "99"),
    "1/",
]


@QUICK
@given(
    text=st.one_of(st.text(max_size=20), st.lists(st.sampled_from(UNIT_SIGNS), max_size=12).map("".join)),
    target=st.sampled_from(sorted(EXPECTED)),
)
def test_any_unit(text: str, target: str) -> None:
    with suppress(UnitError):
        assert factor(text, target) > 0


GOOD = {
    "boulder_length_m": "1.5",
    "boulder_width_ft": "5",
    "boulder_height_in": "90",
    "embedment_ratio": "0.5",
    "a_id": "7",
}
CELLS = ["1.5", "2", "60", "0.5", "1,5", "nan", "", "x", "1e400", "7 m", '"', "#", "\x1b[31m", "é", "1_0", "a_id", "ID"]
BESIDE_A_TABLE = (
    "boulder: {length: 1.65, width: 1.68, height: 3.44, density: 2596}\n"
    "soil: {density: 1860, friction_angle: 40, subgrade_reaction: 60}\n"
    "vehicle: {mass: 6800, speed: 13.4, spring: 3103.3e3, damper: 138.91e3}\n"
)


@QUICK
@given(
    columns=st.lists(st.sampled_from(sorted(GOOD)), unique=True),
    count=st.integers(0, 4),
    changes=st.lists(st.tuples(st.integers(0, 4), st.integers(0, 5), st.sampled_from(CELLS)), max_size=3),
    sign=st.sampled_from([",", ";", "\t"]),
)
def test_any_table(tmp_path_factory: pytest.TempPathFactory, columns, count, changes, sign) -> None:
    header = ["embedment_ratio", *(name for name in columns if name != "embedment_ratio")]
    lines = [header, *([GOOD[name] for name in header] for _ in range(count))]
    for line, position, cell in changes:
        lines[line % len(lines)][position : position + 1] = [cell]
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_text("\n".join(sign.join(line) for line in lines))
    given = {name.split("_")[1] for name in header if name.startswith("boulder")}
    text = re.sub(r"(length|width|height): [\d.]+, ", lambda m: "" if m[1] in given else m[0], BESIDE_A_TABLE)
    loads_or_says_why(text, f"table={path}")
