"""Compiled code on the disk: made by a process of its own, loaded by every other, made anew where it is damaged."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels import _jit
from boulder_kernels.heave import Base
from boulder_kernels.numerics import sine_versine
from boulder_kernels.second_opinion import HeaveRecord

pytestmark = pytest.mark.compiled


def forget(kernel: _jit.Kernel, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a kernel be as in a process that has not called it yet."""
    for name, value in {"_ready": {}, "_kept": None, "_fresh": None}.items():
        monkeypatch.setattr(kernel, name, value)


@pytest.fixture
def fresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A kernel of the package that was not called before, and an empty folder for what it is compiled to."""
    tmp_path.chmod(0o700)
    monkeypatch.setattr(_jit, "CACHE_FOLDER", str(tmp_path))
    forget(sine_versine, monkeypatch)
    return tmp_path


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the kernels that were compiled."""
    names: list[str] = []
    monkeypatch.setattr(_jit, "announce", lambda name: contextlib.nullcontext(names.append(name)))
    return names


def marks(folder: Path) -> list[Path]:
    return [path for path in folder.iterdir() if path.is_file() and path.suffix != ".lock"]


def test_the_process_that_calls_compiles_nothing(fresh: Path, compiled: list[str]) -> None:
    """It loads what another one has compiled, once for arguments of each type."""
    expected = tuple(np.float64(x) for x in sine_versine.py_func(0.3))
    for argument in (0.3, 0.3, np.float64(0.3)):
        assert sine_versine(argument) == pytest.approx(expected, rel=1e-15)
    assert compiled == ["sine_versine"]
    assert sum(sine_versine._kept.stats.cache_hits.values()) == 1
    assert not sine_versine._kept.stats.cache_misses
    assert len(marks(fresh)) == 1
    assert sine_versine(1)[0] == pytest.approx(np.sin(1.0))
    assert len(marks(fresh)) == 2


def test_numbas_own_folder_is_left_as_it_was(fresh: Path) -> None:
    before = numba.config.CACHE_DIR
    sine_versine(0.3)
    assert before == numba.config.CACHE_DIR


def damage_index(folder: Path) -> None:
    """Write something else in place of the list of what is kept."""
    for path in folder.rglob("*.nbi"):
        path.write_bytes(b"no list")


def damage_code(folder: Path) -> None:
    """Cut the code short."""
    for path in folder.rglob("*.nbc"):
        path.write_bytes(path.read_bytes()[:100])


@pytest.mark.parametrize("damage", [damage_index, damage_code])
def test_what_is_damaged_is_made_anew(
    fresh: Path, compiled: list[str], monkeypatch: pytest.MonkeyPatch, damage: Callable[[Path], None]
) -> None:
    """At once for this process, and on the disk with the next."""
    expected = sine_versine(0.3)
    damage(fresh)
    for times in (2, 3, 3):
        forget(sine_versine, monkeypatch)
        assert sine_versine(0.3) == expected
        assert len(compiled) == times
    assert not sine_versine._kept.stats.cache_misses


def test_where_nothing_can_be_kept_the_kernel_is_compiled_once_for_this_process(
    fresh: Path, compiled: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a full disk, or where no process can be started."""

    def fail(*_: object) -> None:
        raise OSError

    expected = sine_versine(0.3)
    monkeypatch.setattr(_jit, "CACHE_FOLDER", str(fresh / "other"))
    monkeypatch.setattr(_jit, "compile_elsewhere", fail)
    forget(sine_versine, monkeypatch)
    compiled.clear()
    assert sine_versine(0.3) == sine_versine(0.3) == expected
    assert compiled == ["sine_versine"] * 2  # tried elsewhere, and done here
    monkeypatch.setattr(_jit, "CACHE_FOLDER", None)
    forget(sine_versine, monkeypatch)
    assert sine_versine(0.3) == expected


def test_a_process_that_has_ended_is_started_again(fresh: Path) -> None:
    """It ends when nothing was asked for a while, perhaps just when something is."""
    sine_versine(0.3)
    assert _jit._process is not None
    _jit._process.kill()
    assert sine_versine(2)[0] == pytest.approx(np.sin(2.0))
    assert len(marks(fresh)) == 2


def test_wrong_arguments_are_told_by_numba(fresh: Path) -> None:
    with pytest.raises(numba.TypingError):
        sine_versine("0.3")
    assert sine_versine(theta=0.3) == sine_versine(0.3)


def test_code_is_kept_by_processor_and_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """A home folder that machines share holds code for each of them."""
    before = _jit.machine_hash.__wrapped__()
    assert _jit.machine_hash.__wrapped__() == before
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    named = _jit.machine_hash.__wrapped__()
    monkeypatch.delenv("NUMBA_CPU_NAME")
    monkeypatch.setattr(_jit, "processor", lambda: ("model name : another",))
    assert len({before, named, _jit.machine_hash.__wrapped__()}) == 3


@pytest.mark.parametrize(("features", "ending"), [("sse2 fma avx2", "+fma"), ("sse2", "")])
def test_a_table_says_whether_products_are_fused(monkeypatch: pytest.MonkeyPatch, features: str, ending: str) -> None:
    for name in ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(_jit, "processor", lambda: ("model name : any", f"flags : {features}"))
    assert _jit.target() == f"{_jit.platform.machine()}{ending}"


NAMES = """
import re
import sys
import numba
from boulder_kernels.lanes import group_type

@numba.njit
def first(group):
    return group.y.theta_b[0]

kinds = {"dry": (1, False, True), "wet": (2, True, True)}
for name in sys.argv[1:]:
    record = numba.from_dtype(group_type(*kinds[name]))
    first.compile((record,))
    code = first.inspect_llvm((record,))
    print(name, *sorted({re.sub("v[0-9]+", "", one) for one in re.findall("_ZN8__main__5first\\\\w+", code)}))
"""


def test_compiled_code_for_each_kind_of_group_has_one_name_in_every_process() -> None:
    """What two processes have compiled is loaded into one, where a name stands for one piece of code."""
    names = []
    for order in (("dry", "wet"), ("wet", "dry")):
        command = [sys.executable, "-c", NAMES, *order]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        names.append(sorted(done.stdout.splitlines()))
    assert len(names[0]) == 2
    assert names[0] == names[1]


ROTATIONS = """
import sys
import boulder_sweep
for more in sys.argv[2:]:
    print(boulder_sweep.simulate(boulder_sweep.load(sys.argv[1], more.split())).summary()["max_rotation_deg"])
"""
TAPERED = Path(__file__).parents[2] / "configs" / "rwg.yaml"
DRY, WET = "boulder.taper=0.8", "boulder.taper=0.8 soil.water_table=1m vehicle.speed=12m/s"


@pytest.mark.nightly
def test_code_that_two_processes_have_compiled_runs_in_one(tmp_path: Path) -> None:
    tmp_path.chmod(0o700)

    def rotations(*more: str) -> list[str]:
        command = [sys.executable, "-c", ROTATIONS, str(TAPERED), *more]
        environment = os.environ | {_jit.CACHE_VARIABLE: str(tmp_path)}
        return subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout.split()

    dry, wet = rotations(DRY), rotations(WET)
    assert dry != wet
    assert rotations(DRY, WET) == dry + wet
    assert rotations(WET, DRY) == wet + dry


def test_the_types_that_are_kept_are_those_that_numba_gives() -> None:
    square = np.zeros((3, 3))
    locked = square.copy()
    locked.flags.writeable = False
    records = np.zeros(2, np.dtype([("x", "f8", (8,))]))
    arrays = [square, np.asfortranarray(square), square[:, 1:], square[0], square.astype(np.int8), locked, records]
    values = [*arrays, records.view(np.recarray), 1, 1.0, True, np.float64(1.0), None, bk.corrected()]
    values += [bk.design.SoilMass(1.0, 2.0, 3.0), HeaveRecord(square[0], square, square[0]), Base()]
    for value in (*values, *values):
        assert _jit._type_of(value) == numba.typeof(value), type(value)
