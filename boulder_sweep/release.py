"""Compile the kernels that a wheel carries: ``python -m boulder_sweep.release``, before the wheel is built.

For each target that this processor can run, the commands below are called in processes whose kernels are compiled for
it, and the libraries are put among the sources. zig links them (from PyPI, a part of the development packages) for an
old version of the C library, so that they load on systems of the last ten years.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from boulder_kernels import source_hash
from boulder_kernels._cache import SHIPPED, SOURCES, levels
from boulder_sweep.store.files import put_file

CONFIG = Path(__file__).parents[1] / "configs" / "rwg.yaml"
SPRINGS = "vehicle.spring=[{stiffness: 3103 kN/m}, {beyond: 0.5 m, stiffness: 9000 kN/m}]"
WET, COHESIVE = "soil.water_table=0.5 m", "soil.cohesion=5 kPa"
ELEMENTS = "model.soil={elements: 50}"
VARIANTS: tuple[tuple[str, ...], ...] = (
    (),
    (SPRINGS,),
    (WET,),
    (COHESIVE,),
    (ELEMENTS,),
    (WET, ELEMENTS),
    (ELEMENTS, "model.unloading=plastic_with_gap"),
)
"""Settings for which kernels of their own are compiled."""
FEATURES = {"x86-64-v4": "-prefer-256-bit"}
"""What Numba is told of a processor beside its name: as `boulder_kernels._numba` asks for on such a machine."""
GLIBC = "2.17"


def compile_for(level: str, target: Path) -> None:
    """Compile all kernels for a target, and put the libraries and the hash of their sources into a folder."""
    with tempfile.TemporaryDirectory() as name:
        linker = f"{sys.executable} -m ziglang cc -target {platform.machine()}-linux-gnu.{GLIBC}"
        own = {"BOULDER_SWEEP_CACHE_DIR": f"{name}/cache", "NUMBA_CPU_NAME": level, "CC": linker}
        environment = os.environ | own | {"NUMBA_CPU_FEATURES": FEATURES.get(level, "")}
        for overrides in VARIANTS:
            case = [str(CONFIG), "--quiet", *(word for override in overrides for word in ("--set", override))]
            for words in (["run", *case, "-o", f"{name}/table", "--overwrite"], ["simulate", *case]):
                command = [sys.executable, "-m", "boulder_sweep", *words]
                subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
        shutil.rmtree(target, ignore_errors=True)
        (compiled,) = Path(name).glob("cache/kernels-*/native-*")
        shutil.copytree(compiled, target)
    put_file(target, SOURCES, source_hash().encode())


def main() -> None:
    """Compile for all targets that this processor can run."""
    for level in levels():
        compile_for(level, SHIPPED / level)
        size = sum(file.stat().st_size for file in (SHIPPED / level).iterdir())
        print(f"{SHIPPED / level}: {len(list((SHIPPED / level).iterdir())):,} files, {size:,} bytes")


if __name__ == "__main__":
    main()
