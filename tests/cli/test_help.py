"""Help for newcomers, at once, and nothing heavy loaded for it."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COMMANDS = ("new", "run", "check", "need", "uncertainty", "which", "boundary", "simulate", "status")
HEAVY = ("numba", "pandas", "scipy", "pyarrow", "matplotlib", "joblib", "rich", "pint", "pydantic", "dask")


def test_help_names_every_command_and_the_exit_codes(sweep):
    code, out, err = sweep("--help")
    assert (code, err) == (0, "")
    for command in COMMANDS:
        assert re.search(rf"^  {command} +\S", out, re.MULTILINE)
    for meaning in ("0 done", "1 internal error", "2 wrong use", "3 some designs", "4 the output exists", "130, 143"):
        assert meaning in out


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself_by_example(sweep, command):
    code, out, _ = sweep(command, "--help")
    assert code == 0
    examples = re.findall(rf"^    sweep {command} .*$", out, re.MULTILINE)
    assert examples
    assert "\b" not in out
    for option in re.findall(r"--[a-z-]+", " ".join(examples)):
        assert re.search(rf"^  .*{option}\b", out, re.MULTILINE)


def test_files_named_in_the_help_exist(sweep):
    named = set()
    for words in ([], ["run"], ["check"], ["need"], ["uncertainty"], ["which"], ["boundary"], ["simulate"]):
        named |= set(re.findall(r"configs/\w+\.yaml", sweep(*words, "--help")[1]))
    assert named
    assert all((ROOT / name).is_file() for name in named)


def test_version(sweep):
    from importlib.metadata import version

    assert sweep("--version") == (0, f"sweep {version('boulder-sweep')}\n", "")


@pytest.mark.parametrize(
    ("words", "light"),
    [
        (["--help"], True),
        (["run", "--help"], True),
        (["--version"], True),
        (["check", str(ROOT / "configs" / "m30_sizing.yaml")], False),
        (["check", str(ROOT / "configs" / "crash_tests.yaml")], False),
    ],
)
def test_nothing_heavy_is_loaded(words, light):
    names = (*HEAVY, "numpy") if light else HEAVY
    code = (
        "import sys\n"
        "from boulder_sweep.cli.main import execute\n"
        "code = execute(sys.argv[1:])\n"
        f"loaded = sorted(set({names!r}) & set(sys.modules))\n"
        "sys.exit(f'loaded: {loaded}' if loaded or code else 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_importing_the_package_loads_nothing_heavy():
    names = {*HEAVY, "numpy"}
    code = f"import boulder_sweep, sys; sys.exit(' '.join({names!r} & set(sys.modules)) or None)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_installed_command_is_this_one():
    done = subprocess.run(
        [sys.executable, "-m", "boulder_sweep", "--version"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0
    assert done.stdout.startswith("sweep ")
