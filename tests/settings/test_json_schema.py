"""The JSON Schema for editors: it takes what the program takes, and finds the mistakes that a schema can find."""

from pathlib import Path

import jsonschema
import pytest

from boulder_sweep.settings.problems import Problems
from boulder_sweep.settings.tree import Mapping, Node, Scalar, parse
from docs.studies.json_schema import FILE, schema, text

ROOT = Path(__file__).parents[2]
SIDES_OF_A_BOX = "length: 1.65\n  width: 1.68\n  height: 3.44"
VALIDATOR = jsonschema.Draft202012Validator(schema())


def _plain(node: Node, unit: str = "") -> object:
    """Return a node as an editor reads it: numbers are numbers; a unit after a bracket goes to each value."""
    if isinstance(node, Scalar):
        if node.quoted or unit:
            return f"{node.text} {unit}".strip()
        if not node.text:
            return None
        try:
            number = float(node.text)
        except ValueError:
            return node.text
        return int(number) if number.is_integer() and node.text.isdecimal() else number
    unit = "" if node.unit is None else node.unit.text
    if isinstance(node, Mapping):
        return {entry.key: _plain(entry.value, unit) for entry in node}
    return [_plain(item, unit) for item in node.items]


def _errors(content: str) -> list[str]:
    root = parse(content, "grid.yaml", Problems())
    return [error.json_path for error in VALIDATOR.iter_errors(_plain(root))]


def test_the_file_in_the_repository_is_what_the_command_writes():
    assert (ROOT / FILE).read_text(encoding="utf-8") == text()


def test_it_is_a_schema():
    jsonschema.Draft202012Validator.check_schema(schema())


@pytest.mark.parametrize("path", sorted((ROOT / "configs").glob("*.yaml")), ids=lambda path: path.name)
def test_the_files_of_the_package_are_valid(path):
    assert _errors(path.read_text(encoding="utf-8")) == []


def test_the_examples_of_the_tests_are_valid(example, minimal):
    assert _errors(example) == []
    assert _errors(minimal) == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("height: 3.44", "height: '[3, 3.5] m'"),
        ("height: 3.44", "height: 3.44\n  taper: 0.8"),
        (
            SIDES_OF_A_BOX,
            "profile: [{height: 0, width: 1.5, length: 1.5}, {height: 3.44, width: 1.7, near: 0.8, far: 0.7}]",
        ),
        ("height: 3.44", "height: {from: 3 m, to: 4 m, step: 0.5 m}"),
        ("height: 3.44", "height: {from: 3, to: 4, count: 3}"),
        ("friction_angle: 43.2", "friction_angle: 0.75 rad"),
        ("friction_angle: 43.2", "friction_angle: {mean: [36 deg, 40 deg], cov: 5 %}"),
        ("friction_angle: 43.2", "friction_angle: {distribution: triangular, low: 34, mode: 39, high: 42}"),
        ("friction_angle: 43.2", "friction_angle: {distribution: lognormal, characteristic: 36 deg, cov: 0.08}"),
        ("vehicle:", "model: {readings: {preset: as_printed, inertia: box}, soil: {elements: 500}}\nvehicle:"),
        ("vehicle:", "solver: {accuracy: 0.01 deg, horizon: 1 s}\nvehicle:"),
        ("vehicle:", "criterion:\nvehicle:"),
        ("vehicle:", "allow_unusual: all\nvehicle:"),
        ("vehicle:", "allow_unusual: [vehicle.mass, soil.density]\nvehicle:"),
        (
            "soil:\n  density: 1859.9\n  friction_angle: 43.2\n  subgrade_reaction: 95\n",
            "soil: [{name: a, density: 1700, friction_angle: 30 deg, subgrade_reaction: 10}]\n",
        ),
        *(
            ("soil:\n", f"soil:\n  topsoil: 0.2 m\n  spt: {{{reading}, depth: 1.5 m}}\n")
            for reading in ("n60: 50/75mm", "n: R, energy_ratio: 60 %", "n60: '>50'", "n60: 50+", "n1_60: '> 39'")
        ),
        ("soil:\n", "soil:\n  cpt: [{q_c: 14 MPa, depth: 0}, {q_c: '>40 MPa', depth: 30 m}]\n"),
    ],
)
def test_what_the_program_takes_is_valid(load_it, minimal, old, new):
    content = minimal.replace(old, new)
    load_it(content)
    assert _errors(content) == []


@pytest.mark.parametrize(
    ("old", "new", "path"),
    [
        ("length: 1.65", "lenght: 1.65", "$.boulder"),
        ("height: 3.44", "height: -3.44", "$.boulder.height"),
        ("height: 3.44", "height: 3.44\n  taper: wide", "$.boulder.taper"),
        (
            SIDES_OF_A_BOX,
            "profile: [{height: 0, width: 1.5}, {height: 3.44, width: 1.7, length: 1}]",
            "$.boulder.profile[0]",
        ),
        ("  height: 3.44\n", "", "$.boulder"),
        ("height: 3.44", "height: tall", "$.boulder.height"),
        ("height: 3.44", "height: []", "$.boulder.height"),
        ("height: 3.44", "height: {from: 3, to: 4}", "$.boulder.height"),
        ("height: 3.44", "height: {from: 3, to: 4, count: 3, step: 1}", "$.boulder.height"),
        ("height: 3.44", "height: {mean: 3.4}", "$.boulder.height"),
        ("height: 3.44", "height: {mean: 3.4, sd: 0.1, cov: 5 %}", "$.boulder.height"),
        ("friction_angle: 43.2", "friction_angle: 432", "$.soil.friction_angle"),
        ("friction_angle: 43.2", "friction_angle: {distribution: uniform, low: 36}", "$.soil.friction_angle"),
        ("  subgrade_reaction: 95\n", "", "$.soil"),
        ("site:\n  embedment_depth: 2.03\n", "", "$"),
        (
            "soil:\n  density: 1859.9\n  friction_angle: 43.2\n  subgrade_reaction: 95\n",
            "soil: [{name: a, density: 1700, friction_angle: 30 deg}]\n",
            "$.soil[0]",
        ),
        ("site:", "site:\n  embedment_ratio: 0.5", "$.site"),
        ("soil:\n", "soil:\n  cpt: {q_c: R, depth: 1 m}\n", "$.soil.cpt"),
        ("vehicle:", "vehicel:", "$"),
        ("vehicle:", "criterion: {rating: P4}\nvehicle:", "$.criterion.rating"),
        ("vehicle:", "model: {readings: {inertia: round}}\nvehicle:", "$.model.readings"),
        ("vehicle:", "model: {soil: {elements: 0}}\nvehicle:", "$.model.soil"),
        ("vehicle:", "solver: {accuracy: quick}\nvehicle:", "$.solver.accuracy"),
        ("vehicle:", "name: a/b\nvehicle:", "$.name"),
        ("vehicle:", "allow_unusual: [vehicle.wheels]\nvehicle:", "$.allow_unusual"),
        ("vehicle:", "table: designs.txt\nvehicle:", "$.table"),
    ],
)
def test_mistakes_are_found_where_they_are(problems_of, minimal, old, new, path):
    content = minimal.replace(old, new)
    assert problems_of(content)
    assert path in _errors(content)
