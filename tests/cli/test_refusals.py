"""Wrong use of every command: exit code 2 and words, before anything is computed, and nothing is written."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from boulder_sweep.cli.main import execute
from boulder_sweep.judge.evaluation import Evaluation
from docs.studies.example_pulse import example_pulse
from tests.cli.conftest import GRID
from tests.stones.shapes import box, written

CONFIGS = Path(__file__).parents[2] / "configs"
NO_RESULT = "; the result of a run is a folder"
IS_SETTINGS = "error: my grid.yaml is a settings file; run it first:\n  sweep run 'my grid.yaml'\n"
RESULT_ONLY = "--set, --at and --second-opinion change the settings of a file; small-grid.sweep is the result of a run"
SI_ONLY = "leave out --units us or --json"
NEED = "need SITE --set 'site.embedment_ratio=[0.3, 0.7]'"
"""A question that is asked with a note, which is not given where the question is refused."""
NOTED = "UNCERTAIN --set 'boulder.width=6 m'"
"""The same of a file with uncertain inputs."""


@pytest.fixture(scope="module")
def beside(tmp_path_factory):
    """A folder with a grid, whose design 2 is impossible, its result, a scan, a film and folders in the way."""
    folder = tmp_path_factory.mktemp("refusals")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for name in ("grid.yaml", "my grid.yaml"):
            Path(name).write_text(GRID)
        assert execute(["run", "grid.yaml", "-q"]) == 3
        written(box(1.2, 1.6, 2.5), Path("block.ply"))
        Path("film.csv").write_text("time [ms],rotation [deg]\n0,0\n100,4.4\n")
        Path("pulse.csv").write_text(example_pulse())
        for name in ("folder.parquet", "folder.html"):
            Path(name).mkdir()
    return folder


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("run", "Missing argument 'GRID'"),
        ("run grid.yaml --jobs 0", "--jobs"),
        ("run grid.yaml --jobs 1000000 --overwrite", "1000000 is not in the range 1<=x<=4096"),
        ("run grid.yaml --backend spark", "--backend"),
        ("run grid.yaml --scheduler tcp://x:1", "--scheduler needs --backend dask"),
        ("run grid.yaml --resume --overwrite", "cannot be used together"),
        ("run grid.yaml -q -v", "cannot be used together"),
        ("run grid.yaml --accuracy superb", "--accuracy: solver.accuracy: 'superb' is not fast, balanced, fine"),
        ("run grid.yaml --accuracy '1e-12 deg'", "--accuracy: solver.accuracy: 1e-12 deg is outside"),
        ("run grid.yaml --accuracy ''", "--accuracy: solver.accuracy: '' is not"),
        ("run grid.yaml --set speed", "KEY=VALUE"),
        ("run no.yaml", "there is no such file"),
        ("run grid.yaml --set model.second_opinion=[kp_squared]", "kp_squared is no second opinion"),
        ("run grid.yaml --set model.second_opinion=broom", "did you mean broms"),
        ("check no.yaml", "no.yaml: there is no such file\n"),
        ("check .", ".: is a directory; a file is needed\n"),
        ("new --class H55", "--class H55 is not a class of ASTM F2656; there are M30, M40, M50, SC30"),
        ("new ''", "the name is empty"),
        ("stone none.ply", "error: none.ply: there is no such file"),
        ("stone block.ply --up a", "--up and --facing belong together"),
        ("stone block.ply --up a --facing -a", "error: up: a and facing: -a do not go together"),
        ("stone block.ply --up top --facing a", "error: up: 'top' is no end of a boulder"),
        ("stone block.ply --mass 18.2", "--mass 18.2: write the unit too"),
        ("stone block.ply --mass '-1 t'", "must be positive"),
        ("stone block.ply --unit kg", "--unit"),
        ("stone block.ply --plot rock.doc", "the name of a picture must end in"),
        ("stone block.txt", "is not a scan that can be read"),
        ("stone block.ply SITE", "at a site the boulder must be weighed: give --mass"),
        ("stone block.ply --margin 10%", "--set, --at and --margin belong to a SITE"),
        (f"{NEED} --least depth", "did you mean embedment_depth?"),
        (f"{NEED} --least phi", "did you mean friction_angle"),
        (f"{NEED} -o depths.csv", "must end in .parquet"),
        (f"{NEED} -o memory://answers/least.csv", "must end in .parquet"),
        (f"{NEED} --plot chart.bmp", "must end in"),
        (f"{NEED} --json --units us", "--json is in SI units for this command"),
        (f"{NEED} --margin 1", "--margin 1: must be 0 or more and less than 100 %"),
        (f"{NEED} --probability 120%", "must be more than 0 and less than 100 %"),
        (f"{NEED} --prefer height", "'height' is not one of 'mass', 'depth', 'excavation'"),
        (
            "need SITE --between '5 ft' 9",
            "--between 5 ft 9: write the unit too (m, cm, ft or in), as in --between '5 ft'",
        ),
        ("need SITE --between 5 '2,5 m'", "as in --between '5 m' '2,5 m' or --between '5 ft' '2,5 m'"),
        ("need SITE --most speed --between 5 9", "--between '5 m/s' '9 m/s' or --between '5 mph' '9 mph'"),
        (f"need {NOTED} --at p5 --probability 0.9", "--at and --probability cannot be used together"),
        ("uncertainty SITE", "no input has a distribution"),
        (f"uncertainty {NOTED} --margin=-0.5", "--margin -0.5: must be 0 or more and less than 100 %"),
        (f"uncertainty {NOTED} --design 1", "holds 1 design, numbered from 0; there is no 1"),
        (f"uncertainty {NOTED} --json --units us", SI_ONLY),
        ("capacity SITE --json --units us", SI_ONLY),
        ("compare small-grid.sweep small-grid.sweep --json --units us", "--json is in SI units"),
        ("simulate RWG --at p5", "no input has a distribution"),
        *((f"{command} {NOTED} --at p99", "'p99' is not mean") for command in ("need", "capacity", "run")),
        (f"uncertainty {NOTED} --half-width 80%", "must be between 0.000001 and 0.5"),
        (f"uncertainty {NOTED} --plot picture.jpeg", "must end in"),
        (f"capacity {NOTED} -o table.txt", "must end in .parquet"),
        (f"simulate {NOTED} --design 7", "there is no 7"),
        (f"explore {NOTED} --design 7", "there is no 7"),
        (f"simulate {NOTED} --at p80", "'p80' is not mean, p5 or another quantile"),
        ("simulate no.sweep", f"there is no no.sweep{NO_RESULT}"),
        ("simulate .", ". is not the result of a sweep: no rows of it are finished"),
        ("simulate depths.parquet", f"there is no depths.parquet{NO_RESULT}"),
        ("simulate no.yaml", "no.yaml: there is no such file"),
        ("simulate small-grid.sweep --design 18", "small-grid.sweep has 18 designs, numbered from 0; there is no 18"),
        ("simulate small-grid.sweep --set 'vehicle.speed=30 mph'", RESULT_ONLY),
        ("simulate small-grid.sweep --at mean", RESULT_ONLY),
        ("simulate small-grid.sweep --plot x.bmp", "must end in"),
        ("simulate small-grid.sweep --trajectory t.csv", "must end in"),
        ("simulate RWG --trajectory t.csv", "t.csv: a time history is a Parquet file; its name must end in .parquet"),
        ("simulate RWG --trajectory no/t.parquet", "no/t.parquet: the folder HERE/no does not exist"),
        ("simulate RWG --trajectory folder.parquet", "folder.parquet cannot be written: Is a directory"),
        ("simulate RWG --trajectory ./t.parquet --plot t.parquet", "./t.parquet is named twice; give each output a"),
        ("simulate RWG --plot x.png --energy HERE/x.png", "is named twice"),
        ("simulate RWG --energy e.bmp", "must end in .png, .svg, .pdf"),
        ("simulate RWG --animate film.png", "must end in .gif"),
        ("simulate RWG --plot x.png --animate no/film.gif", "does not exist"),
        ("explore --at p5 --no-open", "--at is for a file with uncertain inputs"),
        ("explore --set soil.friction_angle=40", "--set"),
        ("explore grid.yaml --design 18", "holds 18 designs, numbered from 0; there is no 18"),
        ("explore grid.yaml --design 2", "design 2 cannot be computed: embedment depth"),
        ("explore --design 5", "Error: rwg holds 1 design, numbered from 0; there is no 5\n"),
        *(
            (f"{command} -o {name}", f"error: {name}: the name of a page must end in .html, .htm or .pdf\n")
            for command in ("report small-grid.sweep", "explore grid.yaml --design 3")
            for name in ("grid.yaml", "small-grid.sweep", "page", "page.html.txt")
        ),
        *(
            (f"{command} -o {name}", f"error: {name}{why}\n")
            for command in ("report small-grid.sweep", "explore grid.yaml --design 3")
            for name, why in (
                ("none/page.html", ": the folder HERE/none does not exist"),
                ("folder.html", " cannot be written: Is a directory"),
                (
                    "small-grid.sweep/page.html",
                    ": the folder HERE/small-grid.sweep holds the result of a run; name a file outside it",
                ),
            )
        ),
        ("report none/gone.sweep", "there is no none/gone.sweep"),
        ("report small-grid.sweep --date ''", "--date is empty; write one line of text, or leave it out"),
        *(
            (f"{command} {name}{rest}", message)
            for command, rest in (("report", ""), ("plot", ""), ("export", " -o t.csv"), ("compare", " x"))
            for name, message in (
                ("nowhere.sweep", f"there is no nowhere.sweep{NO_RESULT}"),
                ("nowhere/at/all", "there is no nowhere/at/all"),
                ("grid.yaml/x", "there is no grid.yaml/x"),
                (".", "is not the result of a sweep"),
                ("'my grid.yaml'", IS_SETTINGS),
            )
        ),
        ("plot small-grid.sweep --at subgrade_reaction_MN_m3", "missing ="),
        ("plot small-grid.sweep --at subgrade_reaction_MN_m3=stiff", "'stiff' is not a number"),
        ("plot small-grid.sweep --at 'subgrade_reaction=95 m'", "'m' is a length"),
        ("plot small-grid.sweep --at soil=dense", "this result has no named sets of soil"),
        (
            "plot small-grid.sweep --at subgrade_reaction_MN_m3=60 --at 'subgrade_reaction_MN_m3 = 95'",
            "is given twice",
        ),
        (
            "plot small-grid.sweep --across weight",
            "--across 'weight' is not an input; did you mean boulder.mass or vehicle.mass?",
        ),
        (
            "plot small-grid.sweep --at subgrade=95",
            "--at 'subgrade' is not an input; did you mean subgrade_reaction?",
        ),
        ("plot small-grid.sweep --up boulder.mass", "boulder_mass_kg is not an input column"),
        ("plot small-grid.sweep -o map.jpeg", "must end in .png"),
        ("fit-vehicle pulse.csv --mass 6800", "write the unit too"),
        ("fit-vehicle pulse.csv --mass '-5 kg'", "must be positive"),
        ("fit-vehicle pulse.csv --mass '15 lb'", "--mass: 6.80389 kg is far outside what vehicles have"),
        ("fit-vehicle pulse.csv --mass '6800 kg' --speed '30 deg'", "a speed is needed"),
        ("fit-vehicle pulse.csv --mass '6800 kg' --speed '3.7 m/s'", "the record says 13.4 ± 0.1 m/s, --speed 3.7 m/s"),
        ("fit-vehicle pulse.csv --mass '6800 kg' --plot fit.jpeg", "must end in .png"),
        ("validate --measured x.csv", "go together"),
        ("validate --case rwg", "go together"),
        ("validate --measured missing.csv --case rwg", "there is no such file"),
        ("validate --measured film.csv --case missing.yaml", "missing.yaml"),
        ("validate --measured film.csv --case M30", "holds 107,008 designs"),
    ],
)
def test_wrong_use_is_told_before_anything_is_done(sweep, beside, monkeypatch, words, message):
    monkeypatch.chdir(beside)
    for name in ("__call__", "warm_up"):
        monkeypatch.setattr(Evaluation, name, lambda *_, **__: pytest.fail("computed"))
    monkeypatch.setattr("boulder_sweep.impact.simulation.simulate", lambda *_, **__: pytest.fail("computed"))
    monkeypatch.setattr("webbrowser.open", lambda _: pytest.fail("opened"))
    places = {"SITE": "site", "UNCERTAIN": "uncertain_site", "RWG": "rwg", "M30": "m30_sizing"}
    for word, name in places.items():
        words = words.replace(word, str(CONFIGS / f"{name}.yaml"))
    before = {path: path.read_bytes() for path in beside.rglob("*") if path.is_file()}
    code, out, err = sweep(*shlex.split(words.replace("HERE", str(beside))))
    assert (code, out) == (2, "")
    told = message.replace("HERE", str(beside))
    assert told in err or told in " ".join(err.split())
    assert not any(word in err for word in ("note: ", "Traceback", "internal"))
    assert {path: path.read_bytes() for path in beside.rglob("*") if path.is_file()} == before
