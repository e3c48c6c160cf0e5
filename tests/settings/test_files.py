"""Files that are none, too large, or meant to do harm: a clear error each, at once, and nothing else."""

import os
import re
import subprocess
import sys

import pytest

from boulder_sweep.settings import SettingsError, load
from boulder_sweep.settings.loader import MAX_BYTES
from tests.counting import calls_of
from tests.settings.conftest import MINIMAL


def _error(path):
    with pytest.raises(SettingsError) as caught:
        load(path)
    return str(caught.value)


def test_a_file_loads_from_its_path(tmp_path, minimal):
    path = tmp_path / "my grid.yaml"
    path.write_text(minimal)
    sweep = load(str(path))
    assert sweep.path == path
    assert sweep.name == "my-grid"


def test_byte_order_mark_and_windows_lines(tmp_path, minimal):
    path = tmp_path / "a.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + minimal.replace("\n", "\r\n").encode())
    assert load(path).n_designs == 1
    path.write_bytes(minimal.replace("\n", "\r\n").replace("95", "x").encode())
    assert _error(path).startswith(f"{path}:11:22: soil.subgrade_reaction: 'x' is not a number")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda path: None, "PATH: there is no such file"),
        (lambda path: path.mkdir(), "is a directory"),
        (os.mkfifo, "not a regular file"),  # and not waited for
        (lambda path: path.write_bytes(MINIMAL.replace("43.2", "43.2°").encode("latin-1")), "PATH:10:23: is not UTF-8"),
        *(
            (lambda path, encoding=encoding: path.write_bytes(MINIMAL.encode(encoding)), "UTF-8")
            for encoding in ("utf-16", "utf-16-le", "utf-16-be", "utf-32")
        ),
        *(
            (lambda path, data=data: path.write_bytes(data), "text")
            for data in (bytes(range(256)), b"PAR1\x00\x00", b"\x7fELF\x02", b"\x89PNG\r\n\x1a\n\x00", b"\x07\x08")
        ),
        (
            lambda path: os.truncate(os.open(path, os.O_CREAT | os.O_WRONLY), 100_000_000),
            "PATH: has 100.0 MB; at most 0.",
        ),
    ],
)
def test_files_that_are_none(tmp_path, make, words):
    path = tmp_path / "a.yaml"
    make(path)
    message = _error(path)
    assert words.replace("PATH", str(path)) in message
    assert "\n" not in message


def test_a_list_of_designs_in_the_place_of_settings_is_told_where_it_belongs(tmp_path):
    path = tmp_path / "yard.csv"
    path.write_text("boulder_height_m\n3\n")
    assert _error(path).endswith("with what its columns do not give: table: yard.csv")


@pytest.mark.parametrize("name", ["a\x00b", "x" * 5000])
def test_impossible_names(name):
    assert "cannot be opened" in _error(name)


def test_the_largest_file_is_read_in_a_few_steps_a_byte(tmp_path, minimal):
    path = tmp_path / "a.yaml"
    path.write_text(minimal.ljust(MAX_BYTES, "#"))
    found = []
    assert calls_of(lambda: found.append(load(path))) < 4 * MAX_BYTES
    assert found[0].n_designs == 1


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        *((text, None, "consists of blocks") for text in ("42", "- boulder", "[boulder]", "just text", "'x'")),
        *((text, None, "empty|blocks") for text in ("", "\n\n", "# nothing\n", "---\n...\n")),
        *((text, None, "") for text in ('a: "\\UFFFFFFFF"', 'a: "\\ud800"', "a: \x07", "a: \ufffe")),
        ("boulder: {length: 1\n", 2, "not closed"),
        ("boulder: [1, 2\nsite: 3", 2, "not valid YAML"),
        ("a: 'b\n", 2, "quotation marks are not closed"),
        ("a:\n\t- b", 2, "not with tabs"),
        ("a: b: c", 1, "unexpected ':'"),
        ("a: @b", 1, "quotation marks"),
        ("a: 1\n  b: 2", 2, "not valid YAML"),
        ('a: "\\q"', 1, "not valid YAML"),
        ("%YAML 9.9\n---\na: 1", 1, "not valid YAML"),
        *(
            (sign * 3000, 1, "nested more than 20 deep")
            for sign in ("[", "{a: ", "- ", "? ", "{? [", "!!python/tuple [")
        ),
        ("".join(f"{' ' * i}a:\n" for i in range(900)), None, "nested more than 20 deep"),
        ("a: " + "[" * 3000 + "]" * 3000, None, "nested"),
        ("boulder: {length: 1}\n---\nboulder: {length: 3}\n", 2, "second document"),
        *((text, None, "a key must be one word") for text in ("[boulder]: 3", "{a: b}: 3", "? [a, b]\n: c")),
        ("boulder: &b {length: *b}", None, "refers to itself"),
        ("boulder: *nothing", None, "is not defined"),
        ("boulder: &a [*a, *a]", None, "refers to itself"),
        ("<<: {solver: {step: 1 ms}}\n", 1, "<<: "),  # merge keys and words of YAML 1.1 have no meaning
    ],
)
def test_texts_that_are_no_settings(problems_of, text, line, words):
    problems = [problem for problem in problems_of(text) if re.search(words, str(problem))]
    assert problems
    assert line in (None, problems[-1].line)


def test_alias_bomb(problems_of):
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 15)]
    found = []
    assert calls_of(lambda: found.extend(problems_of("\n".join(lines)))) < 1_000_000  # of 10^15 values in all
    assert "more than 100000 values" in found[-1].message


def test_aliases_are_accepted_where_they_are_harmless(load_it, minimal):
    text = minimal.replace("length: 1.65", "length: &side 1.65 m").replace("width: 1.68", "width: *side")
    assert load_it(text).constants["boulder_width_m"] == 1.65


@pytest.mark.parametrize(
    "tag",
    [
        "!!python/object/apply:os.system",
        "!!python/name:os.system",
        "!!float",
        "!!str",
        "!x",
        "!<tag:yaml.org,2002:int>",
        "!",
    ],
)
def test_tags_are_refused_at_their_place(problems_of, minimal, tag):
    problems = problems_of(minimal.replace("1.68", f"{tag} '1.68'"))
    assert [(problem.line, problem.column) for problem in problems] == [(3, 10)]
    assert "tag" in problems[0].message


def test_a_tag_runs_nothing(tmp_path, problems_of):
    mark = tmp_path / "mark"
    problems_of(f"boulder: !!python/object/apply:os.system ['touch {mark}']")
    assert not mark.exists()


def test_a_unit_behind_a_bracket_keeps_positions_and_comments(problems_of, load_it, minimal):
    good = minimal.replace("43.2", "[36, 40] deg  # two soils")
    assert load_it(good).axes[0].values.tolist() == [36.0, 40.0]
    flow = minimal.replace(
        "soil:\n  density: 1859.9\n  friction_angle: 43.2\n  subgrade_reaction: 95",
        "soil: {friction_angle: [36, 40] deg, density: x, subgrade_reaction: [20, 30] MN/m^3 }",
    )
    (problem,) = problems_of(flow)
    assert (problem.line, problem.column, problem.key) == (8, 47, "soil.density")
    assert load_it(flow.replace("x,", "1900,")).n_designs == 4
    (problem,) = problems_of(minimal.replace("43.2", "[36, 40] dge"))
    assert "did you mean deg?" in problem.message


def test_a_bracket_in_quotes_or_comments_is_text(load_it, minimal):
    text = minimal + "name: \"a\" # [1] deg, 'x' ] y\n"
    assert load_it(text).name == "a"


def test_reading_needs_no_recursion(tmp_path):
    path = tmp_path / "deep.yaml"
    path.write_text("a: " + "[" * 100_000)
    code = (
        "import sys\n"
        "from boulder_sweep.cli.main import execute\n"
        "sys.setrecursionlimit(250)\n"
        "sys.exit(execute(['check', sys.argv[1]]))\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
