"""``sweep check``: what is in a file, and what is wrong with it."""

from pathlib import Path

from boulder_sweep.settings import load
from boulder_sweep.views.log_text import log_lines

CONFIGS = Path(__file__).parents[2] / "configs"


def test_a_valid_file(sweep, grid):
    code, out, err = sweep("check", grid)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "grid.yaml: valid"
    assert lines[1] == "small grid: 18 designs"
    assert [line.split()[0] for line in lines[2:]] == [
        "boulder_height_m",
        "embedment_depth_m",
        "subgrade_reaction_MN_m3",
    ]
    assert "1.6 to 3.5 m" in lines[2]


def test_a_file_of_which_no_design_can_run_is_refused(sweep, grid):
    code, out, err = sweep("check", grid, "--set", "site.embedment_depth=3.5 m")
    assert (code, out) == (2, "")
    assert err.endswith("grid.yaml: no design can be computed: embedment depth is not less than the boulder's height\n")
    assert sweep("check", grid, "--set", "site.embedment_depth=3.4 m")[0] == 0, "one can"


def test_remarks_go_to_stderr(sweep, grid):
    code, out, err = sweep("check", grid, "--set", "vehicle.speed=30")
    assert code == 0
    assert err.startswith("note: --set: vehicle.speed: 30 m/s is outside the usual range")
    assert "note" not in out


def test_a_log_is_drawn(sweep):
    code, out, err = sweep("check", CONFIGS / "borehole_log.yaml")
    assert code == 0
    assert out.split("\n\n")[1].partition("\nnext, ")[0].splitlines() == log_lines(
        load(CONFIGS / "borehole_log.yaml").derived["soil"][0]
    )
    assert "note: soil: borehole_log.csv, hole BH-2; friction angle" in err


def test_mistakes_in_a_log_stand_at_their_cells(sweep, grid):
    (grid.parent / "log.csv").write_text("Depth (m),N60\n0.5,17\n1.0,many\n")
    code, out, err = sweep("check", grid, "--set", "soil={log: log.csv}")
    assert (code, out) == (2, "")
    assert err.startswith("log.csv:3:5: soil: n60: 'many' is not a number")


def test_mistakes(sweep, grid):
    grid.write_text(grid.read_text().replace("1.65 m", "1.65 kg").replace("43.2 deg", "no"))
    code, out, err = sweep("check", grid, "--set", "vehicle.speed=fast")
    assert (code, out) == (2, "")
    lines = err.splitlines()
    assert len(lines) == 3
    assert lines[0].startswith("grid.yaml:2:19: boulder.length: ")
    assert lines[1].startswith("grid.yaml:4:48: soil.friction_angle: ")
    assert lines[2].startswith("--set: vehicle.speed: ")


def test_uncertain_inputs_are_listed(sweep, grid):
    text = grid.read_text().replace("43.2 deg", "{mean: 38 deg, sd: 3 deg}")
    grid.write_text(text.replace("[60, 95] MN/m^3", "{distribution: lognormal, mean: [60, 95] MN/m^3, cov: 30 %}"))
    code, out, _ = sweep("check", grid)
    assert code == 0
    words = [" ".join(line.split()) for line in out.splitlines()]
    assert "friction_angle_deg uncertain normal, sd 3 deg, mean 38" in words
    assert "subgrade_reaction_MN_m3 uncertain lognormal, cov 30 %" in words


def test_named_soils_are_listed(sweep, grid):
    start, stop = grid.read_text().index("soil:"), grid.read_text().index("vehicle:")
    soils = "soil:\n  - {name: A, density: 1860, friction_angle: 36, subgrade_reaction: 40}\n"
    soils += "  - {name: B 2, density: 1860, friction_angle: 42, subgrade_reaction: 90}\n"
    grid.write_text(grid.read_text()[:start] + soils + grid.read_text()[stop:])
    code, out, _ = sweep("check", grid)
    assert code == 0
    assert [line.split(maxsplit=3) for line in out.splitlines()][-1] == ["soil", "2", "sets", "A, B 2"]
    second = "  - {name: B 2, density: 1860, friction_angle: 42, subgrade_reaction: 90}\n"
    grid.write_text(grid.read_text().replace(second, ""))
    _, out, _ = sweep("check", grid)
    assert out.splitlines()[-1].split() == ["soil", "1", "set", "A"]


def test_a_table_and_its_text_columns(sweep, grid):
    grid.with_name("designs.csv").write_text("block_id,boulder_height_ft,remark\n1,11,a\n2,12,b\n")
    text = grid.read_text().replace("height: [1.6, 2.6, 3.5] m, ", "").replace("[60, 95]", "60")
    grid.write_text(text.replace("[0.9, 1.8, 2.6]", "1.8") + "table: designs.csv\n")
    assert sweep("check", grid)[:2] == (
        0,
        "grid.yaml: valid\nsmall grid: 2 designs from designs.csv, with block_id, remark\n",
    )


def test_few_soil_elements_are_noted_by_every_command_that_simulates(sweep, grid):
    few = ("--set", "model.soil.elements=1")
    note = "model.soil: 1 soil element: sums over so few may give other verdicts; take 200 or more, or closed_form"
    for command in (("check", grid), ("run", grid, "--dry-run"), ("simulate", grid), ("need", grid)):
        _, _, err = sweep(*command, *few)
        assert note in " ".join(err.split()), command
    _, _, err = sweep("simulate", grid, *few, "-q")
    assert "soil element" not in err
    assert "199 soil elements: sums over so few" in sweep("check", grid, "--set", "model.soil.elements=199")[2]
    assert sweep("check", grid, "--set", "model.soil.elements=200")[2] == ""
