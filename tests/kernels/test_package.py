"""The package as a whole: what it imports, where it keeps compiled code, and that the code is found there again."""

import ast
import importlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

import boulder_kernels
from boulder_kernels import _jit

SOURCES = sorted(Path(boulder_kernels.__file__).parent.glob("*.py"))
ALLOWED = {"numpy", "numba", "llvmlite"}  # llvmlite is a part of Numba
RUN = """
import numpy as np
import boulder_kernels as bk
boulder, soil, truck = (1.65, 1.68, 3.44, 2596.0), (1859.9, 0.754, 95.0, 1.0), (6722.0, 14.5, 3103.3e3, 138.91e3)
table = bk.DesignTable(*(np.array([x]) for x in (*boulder, 2.03, 0.938, *soil, *truck, 0.5)))
for elements in (0, 50):
    found = bk.simulate_table(table, bk.corrected(), bk.Control(8e-3, 0.5, 0.35, elements, False))
    print(*(float(column[0]).hex() for column in found))
"""


def imports_of(source: Path) -> set[str]:
    """Packages that a file imports, its own left out."""
    found = set()
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            found.add(node.module.partition(".")[0])
    return found


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.name)
def test_imports_are_few(source: Path) -> None:
    """NumPy, Numba and the standard library: kernels know nothing of files, units or tables."""
    assert imports_of(source) <= ALLOWED | set(sys.stdlib_module_names)


def test_nothing_else_is_loaded() -> None:
    """Nor by way of others: importing the kernels loads no package of a table, a plot or a settings file."""
    script = "import sys, boulder_kernels; print(*{name.partition('.')[0] for name in sys.modules})"
    loaded = run(script, {}).split()
    foreign = {"pandas", "pyarrow", "matplotlib", "joblib", "pint", "pydantic", "click", "boulder_sweep"}
    assert not foreign & set(loaded)


def run(script: str, environment: dict[str, str]) -> str:
    """Run a script in a process of its own that finds these kernels."""
    path = os.pathsep.join([str(SOURCES[0].parents[1]), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.compiled
def test_a_second_process_compiles_nothing(tmp_path: Path) -> None:
    """It finds all machine code on the disk, as the first one did: no new file, none written again, the same bits."""
    environment = {_jit.CACHE_VARIABLE: str(tmp_path)}
    bits = run(RUN, environment)
    files = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*") if file.is_file()}
    assert files
    folder = f"kernels-{_jit.source_hash()[:16]}"
    assert {file.relative_to(tmp_path).parts[0] for file in files} == {folder}
    assert run(RUN, environment) == bits
    assert {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*") if file.is_file()} == files


def test_the_hash_tells_sources_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A change of one character anywhere in the package, or another name of a file, is another hash."""
    for source in SOURCES:
        (tmp_path / source.name).write_bytes(source.read_bytes())
    monkeypatch.setattr(_jit, "__file__", str(tmp_path / "_jit.py"))
    before = _jit.source_hash()
    monkeypatch.undo()
    assert before == _jit.source_hash() == boulder_kernels.source_hash()
    monkeypatch.setattr(_jit, "__file__", str(tmp_path / "_jit.py"))
    soil = tmp_path / "soil.py"
    soil.write_text(soil.read_text().replace("0.25", "0.26", 1))
    assert _jit.source_hash() != before
    soil.write_bytes(SOURCES[[s.name for s in SOURCES].index("soil.py")].read_bytes())
    assert _jit.source_hash() == before
    soil.rename(tmp_path / "soil2.py")
    assert _jit.source_hash() != before


def test_folder_of_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The one that is named; else the user's; else a temporary one of this user's own; named by the hashes."""
    name = f"kernels-{_jit.source_hash()[:16]}/native-{_jit.machine_hash()[:16]}"
    monkeypatch.setenv(_jit.CACHE_VARIABLE, str(tmp_path / "named"))
    assert _jit._cache_folder() == str(tmp_path / "named" / name)
    monkeypatch.delenv(_jit.CACHE_VARIABLE)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert _jit._cache_folder() == str(tmp_path / "xdg" / "boulder-sweep" / name)
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert _jit._cache_folder() == str(tmp_path / "home" / ".cache" / "boulder-sweep" / name)


def test_where_no_folder_can_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without any folder to write to, there is no cache, and the kernels still work."""
    blocked = tmp_path / "file"
    blocked.write_text("a file where a folder should be")
    monkeypatch.setenv(_jit.CACHE_VARIABLE, str(blocked))
    monkeypatch.setenv("XDG_CACHE_HOME", str(blocked))
    monkeypatch.setattr(_jit.tempfile, "gettempdir", lambda: str(blocked))
    with pytest.warns(UserWarning, match="compiled kernels are not kept.*is not a folder.*BOULDER_SWEEP_CACHE_DIR"):
        assert _jit._cache_folder() is None
    monkeypatch.setattr(_jit, "CACHE_FOLDER", None)
    assert _jit.kernel(lambda x: x + 1.0)(1.0) == 2.0


def test_without_a_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A service account may have none: the temporary folder is what is left."""

    def homeless() -> Path:
        raise RuntimeError("no home")

    monkeypatch.delenv(_jit.CACHE_VARIABLE, raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(_jit.Path, "home", homeless)
    monkeypatch.setattr(_jit.tempfile, "gettempdir", lambda: str(tmp_path))
    folder = _jit._cache_folder()
    assert folder is not None
    assert Path(folder).is_relative_to(tmp_path)


def test_public_names() -> None:
    for name in boulder_kernels.__all__:
        assert getattr(boulder_kernels, name) is not None
    assert list(boulder_kernels.__all__) == sorted(boulder_kernels.__all__, key=lambda name: (not name.isupper(), name))
    for source in SOURCES:
        module = importlib.import_module(
            f"boulder_kernels.{source.stem}" if source.stem != "__init__" else "boulder_kernels"
        )
        assert module.__doc__


def test_every_function_says_what_it_does() -> None:
    for source in SOURCES:
        for node in ast.walk(ast.parse(source.read_text())):
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                assert ast.get_docstring(node), f"{source.name}: {node.name}"


CALLED = """
from boulder_kernels import _jit

@_jit.kernel
def half(x):
    return 0.5 * x

@_jit.kernel
def quarter(x):
    return half(half(x))

print(quarter(1.0), half(1.0), half(3), quarter(1.0))
"""


MORE = """
import numpy as np
from called import _jit, half

@_jit.kernel
def halves(x):
    y = np.empty_like(x)
    for i in range(x.size):
        y[i] = half(x[i])
    return y

print(half(1.0), *halves(np.arange(3.0)))
"""


@pytest.mark.compiled
def test_compiling_after_loading(tmp_path: Path) -> None:
    """A process that has loaded kernels can still compile others, which call them."""
    for name, source in (("called.py", CALLED), ("more.py", MORE)):
        (tmp_path / name).write_text(source)
    environment = {_jit.CACHE_VARIABLE: str(tmp_path / "cache")}
    run(f"import sys; sys.path.append({str(tmp_path)!r}); import called", environment)
    printed = run(f"import sys; sys.path.append({str(tmp_path)!r}); import more", environment)
    assert printed.split() == ["0.25", "0.5", "1.5", "0.25", "0.5", "0.0", "0.5", "1.0"]


@pytest.mark.compiled
def test_a_kernel_is_called_from_python_and_by_kernels(tmp_path: Path) -> None:
    """Compiled for kernels first it has no wrapper, and calls from Python must not run into that."""
    (tmp_path / "called.py").write_text(CALLED)
    script = f"import runpy; runpy.run_path({str(tmp_path / 'called.py')!r})"
    for _ in range(2):
        printed = run(script, {_jit.CACHE_VARIABLE: str(tmp_path / "cache")})
        assert printed.split() == ["0.25", "0.5", "1.5", "0.25"]
