"""Help for newcomers, at once, and nothing heavy loaded for it."""

import platform
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COMMANDS = ("new", "run", "check", "stone", "need", "uncertainty", "capacity", "simulate")
HEAVY = ("numba", "pandas", "scipy", "pyarrow", "matplotlib", "joblib", "rich", "pint", "pydantic", "dask", "trimesh")
NOT_FOR_AN_IMPACT = ("pandas", "pyarrow", "matplotlib", "joblib", "rich", "dask", "jinja2")
NOT_FOR_AN_ANSWER = ("pandas", "matplotlib", "joblib", "rich", "dask")


def in_a_process_of_the_command(words: list[str], found: str) -> str:
    """What an expression gives in a process that has just run a command without a problem."""
    code = (
        "import os, sys, time\n"
        "from boulder_sweep.cli.main import main\n"
        "try:\n"
        "    main(sys.argv[1:])\n"
        "except SystemExit as end:\n"
        f"    sys.exit(end.code or 'found: ' + repr(({found})))\n"
    )
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=False)
    assert "found: " in done.stderr, done.stderr
    return done.stderr.split("found: ")[-1].strip()


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
    for words in ([], ["run"], ["check"], ["need"], ["uncertainty"], ["capacity"], ["simulate"]):
        named |= set(re.findall(r"configs/\w+\.yaml", sweep(*words, "--help")[1]))
    assert named
    assert all((ROOT / name).is_file() for name in named)


def test_version(sweep):
    from importlib.metadata import version

    assert sweep("--version") == (0, f"sweep {version('boulder-sweep')}\n", "")


@pytest.mark.parametrize(
    ("words", "unused"),
    [
        (["--help"], (*HEAVY, "numpy")),
        (["run", "--help"], (*HEAVY, "numpy")),
        (["stone", "--help"], (*HEAVY, "numpy")),
        (["--version"], (*HEAVY, "numpy")),
        (["check", str(ROOT / "configs" / "m30_sizing.yaml")], HEAVY),
        (["check", str(ROOT / "configs" / "crash_tests.yaml")], HEAVY),
        (["simulate", str(ROOT / "configs" / "rwg.yaml")], NOT_FOR_AN_IMPACT),
        (["need", str(ROOT / "configs" / "site.yaml")], NOT_FOR_AN_ANSWER),
    ],
)
def test_nothing_heavy_is_loaded(words, unused):
    """Numba, and what it loads, is there only where something is computed."""
    if unused not in (HEAVY, (*HEAVY, "numpy")):
        in_a_process_of_the_command(words, "None")
    done = in_a_process_of_the_command(words, f"sorted(set({unused!r}) & set(sys.modules))")
    assert done == "[]"


def test_no_threads_are_started_for_linear_algebra():
    """OpenBLAS starts them when NumPy is imported; on one core there are none anyway."""
    # The thread in which the command worked takes a moment to end.
    alone = "any(len(os.listdir('/proc/self/task')) == 1 or time.sleep(0.1) for _ in range(6000))"  # hang guard
    words = ["check", str(ROOT / "configs" / "rwg.yaml")]
    assert in_a_process_of_the_command(words, f"({alone}, 'numpy' in sys.modules)") == "(True, True)"


FREED = """
import resource, threading
from boulder_sweep.cli.main import start_light
start_light()
import numpy as np

def blocks():
    for _ in range(50):
        [np.ones(1 << 18) for _ in range(6)]

threads = [threading.Thread(target=blocks) for _ in range(2)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other allocators have other settings")
def test_freed_arrays_are_used_again():
    """Two threads that make and free six arrays of 2 MB fifty times touch little more memory than holds them once."""
    done = subprocess.run([sys.executable, "-c", FREED], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 14_000  # 512 pages an array; up to 97,000 where the system gets them back


def test_only_the_command_keeps_scipy_from_numba():
    """A program that imports the package may multiply matrices in its own compiled code."""
    code = "import boulder_kernels, sys, numba.np.arraymath as a; sys.exit(0 if a._HAVE_BLAS else 'no BLAS')"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_importing_the_package_loads_nothing_heavy():
    names = {*HEAVY, "numpy"}
    code = f"import boulder_sweep, sys; sys.exit(' '.join({names!r} & set(sys.modules)) or None)"
    subprocess.run([sys.executable, "-c", code], check=True)
