"""``sweep new``: a settings file to begin with; completion in the shell."""

import os
import re
import subprocess
import sys

import pytest

from boulder_sweep.settings import SettingsError, load
from boulder_sweep.settings.fields import CLASSES, FIELDS, UNPUBLISHED, starter
from boulder_sweep.settings.units import SYSTEMS

OF_THE_PAPER = [vehicle for vehicle, (code, _) in CLASSES.items() if code == "M"]


@pytest.mark.parametrize("vehicle", OF_THE_PAPER)
@pytest.mark.parametrize("units", SYSTEMS)
def test_the_file_is_valid_and_only_the_speed_beyond_the_fitted_one_has_a_note(tmp_path, vehicle, units):
    path = tmp_path / "new.yaml"
    path.write_text(starter("new", vehicle, units))
    sweep = load(path)
    assert [note.key for note in sweep.notes] == (["vehicle.spring"] if vehicle == "M50" else [])
    assert sweep.depth_sought
    assert sweep.n_designs >= 70
    assert sweep.constants["impact_speed_m_s"] == pytest.approx(int(vehicle[1:]) * 0.44704, rel=1e-4)


@pytest.mark.parametrize(
    ("vehicle", "units"), [("SC60", "si"), ("FS30", "us"), ("PU40", "si"), ("C740", "us"), ("H50", "si")]
)
def test_other_vehicles_have_mass_and_speed_and_ask_for_what_is_not_published(tmp_path, vehicle, units):
    path = tmp_path / "new.yaml"
    text = starter("new", vehicle, units)
    path.write_text(text)
    lines = text.splitlines()
    with pytest.raises(SettingsError) as refused:
        load(path)
    found = [(problem.key, problem.message.split(";")[0]) for problem in refused.value.problems]
    assert found == [(name, "is empty") for name in UNPUBLISHED]
    for problem in refused.value.problems:
        assert lines[problem.line - 1].startswith(f"  {problem.key.removeprefix('vehicle.')}:")
    sweep = load(path, ["vehicle.spring=3 MN/m", "vehicle.damper=1 MN*s/m", "vehicle.bed_offset=1 m"])
    code, mph = CLASSES[vehicle]
    assert vehicle == f"{code}{mph}"
    assert sweep.constants["impact_speed_m_s"] == pytest.approx(mph * 0.44704, rel=1e-4)
    masses_kg = {"SC": 1100, "FS": 2100, "PU": 2300, "C7": 7200, "H": 29500}
    assert sweep.constants["vehicle_mass_kg"] == pytest.approx(masses_kg[code], rel=3e-3)


@pytest.mark.parametrize("units", SYSTEMS)
def test_every_entry_is_in_it_and_every_optional_line_holds(tmp_path, units):
    text = starter("new", units=units)
    path = tmp_path / "new.yaml"
    assert "# table: yard.csv" in text
    assert "# log: borehole.csv" in text
    for field in FIELDS:
        (line,) = re.findall(rf"^  (?:# )?{field.key}: \S.*# {re.escape(field.meaning)}$", text, re.MULTILINE)
        if line.startswith("  #"):
            path.write_text(text.replace(line, line.replace("# ", "", 1)))
            found = _problems(path)
            alternatives = {
                "site.embedment_ratio": "not both",
                "boulder.profile": "is part of boulder.profile",
                "boulder.scan": "follows from the scan; remove one of them",
                "boulder.rock": "follows from boulder.rock; remove one of them",
                "soil.correlation": "needs a distribution",
            }
            assert [p for p in found if alternatives.get(field.path, "-") not in p] == [], field.path


def _problems(path):
    from boulder_sweep.settings import SettingsError

    try:
        load(path)
    except SettingsError as error:
        return [problem.message for problem in error.problems]
    return []


def test_it_writes_once(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = sweep("new", "a b.yaml")
    assert (code, err) == (0, "")
    assert re.fullmatch(r"a b.yaml: \d+ designs. Edit it, then:\n  sweep need 'a b.yaml'\n", out)
    assert "#   sweep check 'a b.yaml' " in (tmp_path / "a b.yaml").read_text()
    assert load("a b.yaml").name == "a-b"
    before = (tmp_path / "a b.yaml").read_bytes()
    assert sweep("new", "a b.yaml") == (4, "", "error: a b.yaml exists already; name another file\n")
    assert (tmp_path / "a b.yaml").read_bytes() == before


def test_it_asks_three_questions_on_a_terminal(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answers = iter(["harbour", "M50", "us"])
    asked = []

    def prompt(text, **_):
        asked.append(text)
        return next(answers)

    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("click.prompt", prompt)
    assert sweep("new", "h.yaml")[0] == 0
    assert len(asked) == 3
    made = load("h.yaml")
    assert (made.name, made.constants["impact_speed_m_s"]) == ("harbour", pytest.approx(22.352))
    assert "162 pcf" in (tmp_path / "h.yaml").read_text()


@pytest.mark.parametrize("file", ["+x.yaml", "two\nlines.yaml", "x\udcff.yaml", "--.yaml"])
def test_any_name_of_a_file_gives_a_valid_file(sweep, tmp_path, file):
    path = tmp_path / file
    code, _, err = sweep("new", path)
    assert (code, err) == (0, "")
    assert load(path).n_designs == 70


def test_it_asks_again_for_a_name_that_settings_refuse(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    answers = iter(["a/b", "a: b # c", "null", "M50", "si"])
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("click.termui.visible_prompt_func", lambda *_: next(answers))
    code, _, err = sweep("new", "h.yaml")
    assert code == 0
    assert err.count("the name must be at most 80 letters, digits, spaces and - _ . +") == 2
    assert load("h.yaml").name == "null"


@pytest.mark.parametrize("end", [EOFError, KeyboardInterrupt])
def test_the_end_of_input_interrupts_it(sweep, tmp_path, monkeypatch, end):
    monkeypatch.chdir(tmp_path)

    def prompt(*_):
        raise end

    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("click.termui.visible_prompt_func", prompt)
    code, out, err = sweep("new", "h.yaml")
    assert (code, out) == (130, "")
    assert err.splitlines()[-1].endswith("interrupted")
    assert list(tmp_path.iterdir()) == []


def test_options_take_the_place_of_the_questions(sweep, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("click.prompt", lambda *_, **__: pytest.fail("asked"))
    code, out, err = sweep("new", "--class", "m40", "--units", "us", "site.yaml")
    assert (code, err) == (0, "")
    assert re.fullmatch(r"site.yaml: \d+ designs. Edit it, then:\n  sweep need site.yaml\n", out)
    text = (tmp_path / "site.yaml").read_text()
    assert text.splitlines()[0].startswith("# site: ")
    assert "  speed: 40 mph " in text
    assert sweep("new", "--units", "us", "m30.yaml")[0] == 0
    assert load("m30.yaml").constants["impact_speed_m_s"] == pytest.approx(13.4112)


@pytest.mark.parametrize("vehicle", ["M40", "H50"])
@pytest.mark.parametrize("units", SYSTEMS)
def test_values_are_in_the_units_asked_for(vehicle, units):
    own = {
        "si": {"m", "kg", "kg/m^3", "MN/m^3", "kN/m", "kN*s/m", "kPa", "km/h"},
        "us": {"ft", "in", "lb", "pcf", "pci", "lb/in", "lb*s/in", "psf", "mph"},
    }[units] | {"deg", "ms", "s", ""}
    for line in starter("new", vehicle, units).splitlines():
        if not (entry := re.match(r"^  (?:# )?[a-z_]+: *(.*?)  +# ", line)):
            continue
        found = re.findall(r"[\d.]+(?: ([a-zA-Z][a-zA-Z0-9/*^]*))?", entry[1])
        assert set(found) <= own, line


def test_a_default_in_us_units_is_the_default(tmp_path):
    path, bare = tmp_path / "new.yaml", tmp_path / "bare.yaml"
    text = starter("new", units="us")
    bare.write_text(text)
    path.write_text(re.sub(r"# (bumper_height|hood_height|bed_offset|min_overlap)", r"\1", text))
    given, default = load(path), load(bare)
    for name in ("bumper_height_m", "hood_height_m", "bed_offset_m"):
        assert given.constants[name] == pytest.approx(default.constants[name], rel=3e-4)  # four digits
    assert given.criterion.min_overlap_m == pytest.approx(default.criterion.min_overlap_m, rel=3e-4)


@pytest.mark.parametrize(("vehicle", "mass"), [("H50", "65000 lb"), ("SC30", "2430 lb")])
def test_it_says_what_to_measure_for_a_vehicle_without_published_values(sweep, tmp_path, monkeypatch, vehicle, mass):
    monkeypatch.chdir(tmp_path)
    code, out, err = sweep("new", "--class", vehicle, "--units", "us", "h.yaml")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == f"h.yaml: fill in three entries; no values are published for {vehicle}."
    assert "  vehicle.spring, vehicle.damper: from a crash against a rigid wall. Measure the" in lines
    assert f"    sweep fit-vehicle PULSE.csv --mass '{mass}'" in lines
    assert lines[-2:] == ["Then:", "  sweep check h.yaml"]
    assert all(len(line) <= 80 for line in lines)
    text = (tmp_path / "h.yaml").read_text()
    for name in ("spring", "damper", "bed_offset"):
        assert re.search(rf"^  {name}: +# fill in: ", text, re.MULTILINE)
    code, _, err = sweep("check", "h.yaml")
    assert code == 2
    assert "vehicle.bed_offset: is empty; a length is needed, such as 2.9 m" in err


def _completed(**variables):
    command = [sys.executable, "-m", "boulder_sweep"]
    done = subprocess.run(command, env={**os.environ, **variables}, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout


def test_the_shell_completes_commands_and_options():
    code, out = _completed(_SWEEP_COMPLETE="zsh_complete", COMP_WORDS="sweep che", COMP_CWORD="1")
    assert code == 0
    assert out.split("\n")[:2] == ["plain", "check"]
    _, out = _completed(_SWEEP_COMPLETE="bash_complete", COMP_WORDS="sweep run --res", COMP_CWORD="2")
    assert out == "plain,--resume\n"
    code, out = _completed(_SWEEP_COMPLETE="fish_source")
    assert code == 0
    assert "_SWEEP_COMPLETE=fish_complete" in out
