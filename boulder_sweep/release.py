"""Compile the kernels that a wheel carries: ``python -m boulder_sweep.release``, before the wheel is built.

The commands below are called once. What they compile for this machine is the list of what a wheel must carry: which
kernels, for which types of arguments. All of it is compiled again for each target of this architecture, in a process
that calls none of it, so the processor need not be one that could. The libraries are put among the sources. zig links
them (from PyPI, a part of the development packages) for an old version of the C library, so that they load on systems
of the last ten years.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from importlib import import_module
from pathlib import Path

from boulder_kernels import _ahead, source_hash
from boulder_kernels._cache import CACHE_VARIABLE, LEVELS, SHIPPED, SOURCES
from boulder_sweep.locations import replacing

CONFIGS = Path(__file__).parents[1] / "configs"
WET, COHESIVE = "soil.water_table=0.5 m", "soil.cohesion=5 kPa"
ELEMENTS = "model.soil={elements: 50}"
VARIANTS: tuple[tuple[str, ...], ...] = (
    (),
    (WET,),
    (COHESIVE,),
    (ELEMENTS,),
    (WET, ELEMENTS),
    ("boulder.taper=0.8",),
)
"""Settings for which kernels of their own are compiled."""
TARGETS = {"x86-64-v4": ("x86-64-v4", "-prefer-256-bit"), "aarch64": ("generic", "")}
"""Name and features of the processor that Numba is told of, where the name is not that of the target. The features are
those that `boulder_kernels._numba` asks for on such a machine."""
GLIBC = "2.17"


def record(folder: Path) -> Path:
    """Compile what the commands need for this machine, in a folder, and return the folder of the compiled kernels."""
    environment = os.environ | {CACHE_VARIABLE: f"{folder}/cache"}
    stone = [str(CONFIGS / "quarry_stone.yaml"), "--set", "soil.friction_angle=40 deg"]
    commands = [["need", str(CONFIGS / "site.yaml"), "--margin", "25%"], ["need", *stone], ["simulate", *stone]]
    for overrides in VARIANTS:
        case = [str(CONFIGS / "rwg.yaml"), *(word for override in overrides for word in ("--set", override))]
        commands += [["run", *case, "-o", f"{folder}/table", "--overwrite"], ["simulate", *case]]
    for words in commands:
        command = [sys.executable, "-m", "boulder_sweep", *words, "--quiet"]
        subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
    (compiled,) = folder.glob("cache/kernels-*/native-*")
    return compiled


def compile_for(level: str, recorded: Path, target: Path) -> None:
    """Compile recorded kernels for a target in another process, and put the libraries into a folder."""
    name, features = TARGETS.get(level, (level, ""))
    linker = f"{sys.executable} -m ziglang cc -target {platform.machine()}-linux-gnu.{GLIBC}"
    variables = {"NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": features, "CC": linker}
    command = [sys.executable, "-m", "boulder_sweep.release", str(recorded), str(target)]
    subprocess.run(command, env=os.environ | variables, check=True)


def compile_recorded(recorded: Path, target: Path) -> None:
    """Compile recorded kernels as this process is told to, and put the libraries and the hash of their sources away.

    Raises
    ------
    RuntimeError
        They cannot be linked.
    """
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir(parents=True)
    for file in sorted(recorded.glob(f"*{_ahead.RETURNS}")):
        module, kernel, _ = file.stem.rsplit("-", 2)
        wanted = getattr(import_module(f"boulder_kernels.{module}"), kernel)
        code, library, kept = wanted.compiler.compiled_ahead(wanted, json.loads(file.read_text())["types"])
        if library is None:
            raise RuntimeError(f"{module}.{kernel} cannot be linked by {os.environ.get('CC', 'cc')}")
        _ahead.keep(target / file.stem, code, library, kept)
    with replacing(target / SOURCES) as sources:
        sources.write(source_hash().encode())


def main() -> None:
    """Compile for all targets of this architecture; with two folders, what the one records into the other."""
    if sys.argv[1:]:
        compile_recorded(*map(Path, sys.argv[1:]))
        return
    shutil.rmtree(SHIPPED, ignore_errors=True)  # the commands would use them, and compile nothing
    with tempfile.TemporaryDirectory() as name:
        recorded = record(Path(name))
        for level, needed in LEVELS.items():
            if platform.machine() in needed:
                compile_for(level, recorded, SHIPPED / level)
                files = [file.stat().st_size for file in (SHIPPED / level).iterdir()]
                print(f"{SHIPPED / level}: {len(files):,} files, {sum(files):,} bytes")


if __name__ == "__main__":
    main()
