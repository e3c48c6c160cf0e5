"""Files that are none, too large, or meant to do harm: a clear error each, at once, and nothing else."""

import os
import subprocess
import sys

import pytest

from boulder_sweep.settings import SettingsError, load
from boulder_sweep.settings.loader import MAX_BYTES
from tests.counting import calls_of


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


def test_missing_file(tmp_path):
    assert _error(tmp_path / "no.yaml") == f"{tmp_path}/no.yaml: there is no such file"


def test_directory(tmp_path):
    assert "is a directory" in _error(tmp_path)


def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    assert "not a regular file" in _error(tmp_path / "pipe.yaml")


@pytest.mark.parametrize("name", ["a\x00b", "x" * 5000])
def test_impossible_names(name):
    assert "cannot be opened" in _error(name)


def test_a_large_file_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "large.yaml"
    with path.open("wb") as stream:
        stream.truncate(100_000_000)
    assert _error(path).startswith(f"{path}: has 100.0 MB; at most 0.5 MB is read")


def test_the_largest_file_is_read_in_a_few_steps_a_byte(tmp_path, minimal):
    path = tmp_path / "a.yaml"
    path.write_text(minimal.ljust(MAX_BYTES, "#"))
    found = []
    assert calls_of(lambda: found.append(load(path))) < 4 * MAX_BYTES
    assert found[0].n_designs == 1


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_other_unicode(tmp_path, minimal, encoding):
    path = tmp_path / "a.yaml"
    path.write_bytes(minimal.encode(encoding))
    message = _error(path)
    assert "UTF-8" in message
    assert "\n" not in message


def test_latin_1(tmp_path, minimal):
    path = tmp_path / "a.yaml"
    path.write_bytes(minimal.replace("43.2", "43.2°").encode("latin-1"))
    assert _error(path) == f"{path}:10:23: is not UTF-8 text; save it as UTF-8"


@pytest.mark.parametrize(
    "data", [bytes(range(256)), b"PAR1\x00\x00", b"\x7fELF\x02", b"\x89PNG\r\n\x1a\n\x00", b"\x07\x08"]
)
def test_binary(tmp_path, data):
    path = tmp_path / "a.yaml"
    path.write_bytes(data)
    assert "text" in _error(path)


@pytest.mark.parametrize("text", ["", "\n\n", "# nothing\n", "---\n...\n"])
def test_empty(problems_of, text):
    assert "empty" in problems_of(text)[0].message or "blocks" in problems_of(text)[0].message


@pytest.mark.parametrize("text", ["42", "- boulder", "[boulder]", "just text", "'x'"])
def test_no_blocks(problems_of, text):
    (problem,) = problems_of(text)
    assert "consists of blocks" in problem.message


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("boulder: {length: 1\n", 2, "not closed"),
        ("boulder: [1, 2\nsite: 3", 2, "not valid YAML"),
        ("a: 'b\n", 2, "quotation marks are not closed"),
        ("a:\n\t- b", 2, "not with tabs"),
        ("a: b: c", 1, "unexpected ':'"),
        ("a: @b", 1, "quotation marks"),
        ("a: 1\n  b: 2", 2, "not valid YAML"),
        ('a: "\\q"', 1, "not valid YAML"),
        ("%YAML 9.9\n---\na: 1", 1, "not valid YAML"),
    ],
)
def test_broken_yaml(problems_of, text, line, words):
    problems = problems_of(text)
    assert words in problems[-1].message
    assert problems[-1].line == line


@pytest.mark.parametrize("text", ['a: "\\UFFFFFFFF"', 'a: "\\ud800"', "a: \x07", "a: \ufffe"])
def test_forbidden_characters(problems_of, text):
    assert problems_of(text)


@pytest.mark.parametrize("opening", ["[", "{a: ", "- ", "? ", "{? [", "!!python/tuple ["])
def test_deep_nesting(problems_of, opening):
    problems = problems_of(opening * 3000)
    assert "nested more than 20 deep" in problems[-1].message
    assert problems[-1].line == 1


def test_deep_nesting_by_indentation(problems_of):
    (problem,) = problems_of("".join(f"{' ' * i}a:\n" for i in range(900)))
    assert "nested more than 20 deep" in problem.message


def test_deep_nesting_closed_again(problems_of):
    assert "nested" in problems_of("a: " + "[" * 3000 + "]" * 3000)[-1].message


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
    ("text", "words"),
    [
        ("boulder: &b {length: *b}", "refers to itself"),
        ("boulder: *nothing", "is not defined"),
        ("boulder: &a [*a, *a]", "refers to itself"),
    ],
)
def test_wrong_aliases(problems_of, text, words):
    assert any(words in problem.message for problem in problems_of(text))


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


def test_one_document_per_file(problems_of, minimal):
    (problem,) = problems_of(minimal + "---\nboulder: {length: 3}\n")
    assert "second document" in problem.message
    assert problem.line == 17


def test_merge_keys_and_words_of_yaml_1_1_have_no_meaning(problems_of, minimal):
    (problem,) = problems_of(minimal + "<<: {solver: {step: 1 ms}}\n")
    assert problem.key == "<<"


@pytest.mark.parametrize("text", ["[boulder]: 3", "{a: b}: 3", "? [a, b]\n: c"])
def test_keys_are_words(problems_of, text):
    assert any("a key must be one word" in problem.message for problem in problems_of(text))


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


def test_nothing_of_the_file_is_executed_or_followed(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("boulder: ${HOME}\nsite: !include /etc/passwd\n")
    assert "root:" not in _error(path)


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
