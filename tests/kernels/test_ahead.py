"""Kernels compiled ahead: the bits of Numba's own calls, and a library for each kind of arguments."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from pathlib import Path

import numba
import numpy as np
import pytest

import boulder_kernels as bk
from boulder_kernels import _ahead, _cache
from boulder_kernels._ahead import UnsuitableError, flatten
from boulder_kernels._numba import call_of, examples
from boulder_kernels.design import constants_of, is_computable
from boulder_kernels.error_estimates import take_seconds
from boulder_kernels.impact import simulate_alone
from boulder_kernels.layered import uniform_layers
from boulder_kernels.numerics import sine_versine
from boulder_kernels.outcomes import PAIR, empty_outcomes
from boulder_kernels.soil_laws import profile_of
from boulder_kernels.table import run_rows

from .samples import control, random_designs, table_of

pytestmark = pytest.mark.compiled
READINGS = bk.corrected()
HOW = control(4e-3, 0.5, np.radians(20.0), stop_at_limit=True)
DESIGNS = random_designs(5, seed=230)
DESIGN = DESIGNS[0]


def problems() -> dict[str, bk.Problem]:
    """One impact in each kind of soil."""
    twice = np.repeat(uniform_layers(DESIGN), 2, axis=0)
    twice[0, 0] = 0.5 * DESIGN.d
    return {
        "uniform": bk.Problem(DESIGN, None),
        "layers": bk.Problem(DESIGN, profile_of(twice, 0)),
        "elements": bk.Problem(DESIGN, profile_of(twice, 20)),
    }


@pytest.mark.parametrize(
    "kind",
    [
        "uniform",
        "layers",
        pytest.param("elements", marks=pytest.mark.nightly),
    ],
)
def test_the_bits_are_those_of_numba(kind: str) -> None:
    """Of one impact, whatever its soil, maxima, times and status."""
    ahead = _ahead.call(simulate_alone, (problems()[kind], READINGS, HOW, bk.no_record()))
    numba = simulate_alone.for_python(problems()[kind], READINGS, HOW, bk.no_record())
    assert isinstance(ahead, bk.Outcome)
    assert np.array_equal(np.hstack([*ahead.maxima, ahead.t_end]), np.hstack([*numba.maxima, numba.t_end]))
    assert (ahead.status, ahead.attempts) == (numba.status, numba.attempts)


def test_arrays_are_read_and_written_in_place() -> None:
    """Inputs of any number of dimensions, and results."""
    found = []
    for call in (run_rows, run_rows.for_python):
        out = empty_outcomes(len(DESIGNS))
        call(np.stack(table_of(DESIGNS)), None, None, None, READINGS, HOW, bk.no_record(), out)
        found.append(out)
    assert np.isfinite(found[0][1]).all()
    assert np.array_equal(*found, equal_nan=True)


def test_what_comes_back_has_its_types() -> None:
    """Records by their class, whole numbers and truth values as such, nothing as None."""
    c = constants_of(DESIGN, READINGS, 7)
    assert type(c) is bk.Constants
    assert type(c.elements) is int
    assert c.elements == 7
    assert is_computable(c) is True
    assert is_computable(c._replace(d=-1.0)) is False
    some, out = np.arange(len(DESIGNS)), empty_outcomes(len(DESIGNS))
    assert take_seconds(out, some, out, np.full(some.size, float(PAIR)), np.stack(table_of(DESIGNS)), 1.5) is None


@pytest.mark.parametrize("kind", problems())
def test_types_tell_what_a_kernel_is_called_with(kind: str) -> None:
    """A release compiles from them: examples of the types have the same types, for Numba, too."""
    arguments = (problems()[kind], READINGS, HOW, bk.no_record(), True, 3, np.zeros((2, 3), np.int8))
    types = ",".join([flatten(value, [], [], []) for value in arguments])
    found = examples(call_of(types))
    assert ",".join([flatten(value, [], [], []) for value in found]) == types
    assert [*map(numba.typeof, found)] == [*map(numba.typeof, arguments)]


def test_no_call_is_refused_that_numba_takes() -> None:
    """An array in another order, or of other numbers: left to Numba, with the same result."""
    designs = np.stack(table_of(DESIGNS))
    layers = np.asfortranarray(np.stack([uniform_layers(one) for one in DESIGNS]))
    with pytest.raises(UnsuitableError):
        _ahead.call(run_rows, (designs, layers, None, None, None, READINGS, HOW, bk.no_record(), designs))
    assert sine_versine(np.float32(0.3))[0] == pytest.approx(np.sin(0.3), rel=1e-6)


@pytest.fixture
def fresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A kernel of the package that was not called before, and an empty folder for what it is compiled to."""
    monkeypatch.setattr(_cache, "CACHE_FOLDER", str(tmp_path))
    monkeypatch.setattr(sine_versine, "natives", {})
    return tmp_path


def test_a_machine_without_a_linker(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The code itself is kept, and loaded by LLVM: the same bits."""
    expected = sine_versine.for_python(0.3)
    monkeypatch.setenv("CC", "there-is-no-such-compiler")
    for _ in range(2):
        assert sine_versine(0.3) == expected
        monkeypatch.setattr(sine_versine, "natives", {})
    assert sorted(file.suffix for file in fresh.glob("*")) == [_ahead.RETURNS, _ahead.OBJECT]


@pytest.mark.parametrize(
    ("ending", "content"),
    [(_ahead.LIBRARY, None), (_ahead.RETURNS, None), (_ahead.RETURNS, b""), (_ahead.RETURNS, b"{")],
    ids=["no library", "nothing beside it", "empty", "cut"],
)
def test_half_of_a_library_is_compiled_again(
    fresh: Path, ending: str, content: bytes | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that was killed, or a power cut, leaves no kernel that cannot be called."""
    expected = sine_versine(0.3)
    (file,) = fresh.glob(f"*{ending}")
    file.unlink()
    if content is not None:
        file.write_bytes(content)
    compiled = []
    monkeypatch.setattr(_ahead, "announce", lambda name: contextlib.nullcontext(compiled.append(name)))
    for _ in range(2):
        sine_versine.natives.clear()
        assert sine_versine(0.3) == expected
    assert compiled == [file.stem], "once"
    assert file.stat().st_size > 1
    assert not [file for file in file.parent.iterdir() if file.suffix not in (_ahead.LIBRARY, _ahead.RETURNS)]


@pytest.mark.parametrize("content", [b"", b"{", b"\x7fELF" + bytes(60)], ids=["empty", "no library", "cut"])
def test_a_library_that_is_not_whole_is_refused(fresh: Path, tmp_path: Path, content: bytes) -> None:
    """Under another name, because the system loads a library that it has loaded only once."""
    sine_versine(0.3)
    (kept,) = fresh.glob(f"*{_ahead.RETURNS}")
    (tmp_path / f"other{_ahead.RETURNS}").write_bytes(kept.read_bytes())
    (tmp_path / f"other{_ahead.LIBRARY}").write_bytes(content)
    with pytest.raises(_ahead.UnusableError):
        _ahead.loaded(tmp_path / "other")


def test_a_full_disk_keeps_nothing(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernel is compiled for this process alone, and no half of a file stays."""

    def full(self: Path, target: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(_ahead.Path, "replace", full)
    assert sine_versine(0.3) == sine_versine.for_python(0.3)
    assert not [file for file in fresh.rglob("*") if file.is_file()]


def test_nothing_is_kept_without_a_folder(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As where no folder is safe: compiled for this process alone."""
    monkeypatch.setattr(_cache, "CACHE_FOLDER", None)
    assert sine_versine(0.3) == sine_versine.for_python(0.3)
    assert not list(fresh.iterdir())


def test_code_is_kept_by_processor_and_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """A home folder that machines share holds code for each of them."""
    before = _cache.machine_hash.__wrapped__()
    assert _cache.machine_hash.__wrapped__() == before
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    named = _cache.machine_hash.__wrapped__()
    monkeypatch.setattr(os, "uname", lambda: os.uname_result(("Linux", "here", "6", "1", "another")))
    assert len({before, named, _cache.machine_hash.__wrapped__()}) >= 2
    assert before != named


def test_libraries_that_came_with_the_package_are_used(
    fresh: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those for the fastest code that this processor can run, if they are of these sources; else they are compiled."""
    expected = sine_versine(0.3)
    compiled = fresh
    shipped = tmp_path_factory.mktemp("package")
    monkeypatch.setattr(_cache, "SHIPPED", shipped)
    monkeypatch.setattr(_cache, "LEVELS", {"too-new": {"no-such-feature"}, "mine": set()})
    monkeypatch.setattr(_cache, "shipped_folder", _cache.shipped_folder.__wrapped__)
    compiled.rename(shipped / "mine")
    for sources, is_used in (("of another version", False), (bk.source_hash(), True)):
        (shipped / "mine" / _cache.SOURCES).write_text(sources)
        sine_versine.natives.clear()
        assert sine_versine(0.3) == expected
        assert bool(list(fresh.glob("*"))) is not is_used
        shutil.rmtree(compiled, ignore_errors=True)
    monkeypatch.setenv("NUMBA_CPU_NAME", "generic")
    assert _cache.shipped_folder() is None


def test_levels_of_processors(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the features that the system reports, on their architecture; every aarch64 has what its code needs."""
    wide = "avx512f avx512bw avx512cd avx512dq avx512vl"
    usual = "avx2 fma bmi1 bmi2 f16c abm movbe"
    for features, found in ((f"{wide} {usual}", ["x86-64-v4", "x86-64-v3"]), (usual, ["x86-64-v3"]), ("sse2", [])):
        monkeypatch.setattr(_cache, "processor", lambda flags=features: ("model name : any", f"flags : {flags}"))
        monkeypatch.setattr(_cache.platform, "machine", lambda: "aarch64")
        assert _cache.levels() == ["aarch64"]
        monkeypatch.setattr(_cache.platform, "machine", lambda: "x86_64")
        assert _cache.levels() == found
        assert ("+fma" in _cache.target()) is (found != [])
