"""Settings, code and machine behind a table.

The *identity* is what must be equal for rows to belong to one table: settings, control of the integration,
versions and the hashes of the code that decides a row. It goes into every part and into the manifest, and a
run is resumed only with the same; the heading of reports, on which no row depends, may change. When, where
and with how many workers rows were computed does not affect
them; that is kept in the manifest only, and the name of the processor in the parts, so that equal runs on equal
machines give equal parts.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import socket
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from boulder_sweep.settings.problems import shorten
from boulder_sweep.settings.sweep import SECTION

PREFIX = "boulder_sweep."
"""Prefix of this package's entries in the metadata of a file."""
FORMAT = 2
"""Of tables and of files of answers: grows by one whenever a column or an entry comes, goes or means something else."""
_PACKAGES = ("boulder-sweep", "numpy", "numba", "llvmlite", "pyarrow")
_PACKAGE_FOLDER = Path(__file__).resolve().parents[1]
_DECIDING_SOURCES = (
    "designs.py",
    "columns.py",
    "elementary.py",
    "soils.py",
    "investigation.py",
    "judge/*.py",
    *(f"settings/{name}.py" for name in ("distributions", "fields", "model", "shape")),
    "stones/rock.py",
)
"""Modules, in addition to the kernels, whose code determines the rows: of settings and stones what others import."""
IDENTITY_KINDS = {
    "format": int,
    "settings": {"name": str, "inputs": dict, "model": dict, "criterion": dict, "solver": dict, "labels": dict},
    "readings": dict,
    "control": dict,
    "accuracy": dict,
    "versions": dict,
    "settings_sha256": str,
    "kernels_sha256": str,
    "rules_sha256": str,
}
"""Kinds of the entries of an identity that are looked at by name."""


@dataclass
class Session:
    """One run into the folder: the first, or one that resumed."""

    started: str
    host: str
    pid: int
    cpu: str
    jobs: int
    backend: str
    command: str
    ended: str | None = None
    how: str | None = None
    """How it ended: ``finished``, or what stopped it; None while it runs, and also if it was killed."""


def canonical(content: Any) -> str:
    """JSON that is the same text for the same content."""
    return json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def sha256_of(content: Any) -> str:
    """SHA-256 of the canonical JSON of some content."""
    return hashlib.sha256(canonical(content).encode()).hexdigest()


def settings_sha256(settings: Mapping[str, Any]) -> str:
    """SHA-256 of resolved settings without the heading of reports, on which no row depends."""
    return sha256_of({key: value for key, value in settings.items() if key != SECTION})


def identity(
    settings: Mapping[str, Any],
    readings: Mapping[str, Any],
    control: Mapping[str, Any],
    accuracy: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Collect what all rows of one table have in common.

    Parameters
    ----------
    settings
        The resolved settings: every default filled in, units in the names.
    readings
        Which formulas are read as printed.
    control
        How the motion is integrated: step, horizon, limit, soil elements.
    accuracy
        The accuracy requested, the step chosen for it, and the error estimated by a pilot.

    Returns
    -------
    dict
        Plain data with the keys ``format``, ``settings``, ``readings``, ``control``, ``accuracy``, ``versions``,
        ``settings_sha256``, ``kernels_sha256``, ``rules_sha256``.
    """
    content = {
        "format": FORMAT,
        "settings": settings,
        "readings": readings,
        "control": control,
        "accuracy": accuracy or {},
        "versions": versions(),
        "settings_sha256": settings_sha256(settings),
        "kernels_sha256": kernels_sha256(),
        "rules_sha256": rules_sha256(),
    }
    return json.loads(canonical(content))  # as it will be read back from a file


def differences(there: Mapping[str, Any], here: Mapping[str, Any]) -> list[str]:
    """List the entries in which two identities differ, one line each; hashes only where nothing else explains them."""
    before, after = _flat(there), _flat(here)
    changed = [key for key in {**before, **after} if before.get(key, _ABSENT) != after.get(key, _ABSENT)]
    changed = [key for key in changed if not key.startswith(f"settings.{SECTION}.")]
    telling = [key for key in changed if not key.endswith("_sha256")]
    if any(key.startswith("settings.") for key in telling):
        changed = [key for key in changed if key != "settings_sha256"]
    return [f"{key}: {_shown(before, key)} -> {_shown(after, key)}" for key in changed]


def identity_in(metadata: Mapping[bytes, bytes] | None) -> dict[str, Any]:
    """Return the identity in the metadata of a file, and what else `file_metadata` wrote; empty of another file."""
    texts = {key.decode(errors="replace"): value for key, value in (metadata or {}).items()}
    entries = {key.removeprefix(PREFIX): value for key, value in texts.items() if key.startswith(PREFIX)}
    parsed = ("format", "settings", "readings", "control", "accuracy", "versions")
    return {key: json.loads(value) if key in parsed else value.decode() for key, value in entries.items()}


def other_version(there: Any) -> str:
    """Say which version wrote a result that this one does not read, and what to do; empty of a result that it reads.

    Parameters
    ----------
    there
        The identity of the result, see `identity`; anything at all of a stranger's.
    """
    there = there if isinstance(there, Mapping) else {}
    if there.get("format") == FORMAT:
        return ""
    recorded = there.get("versions")
    writer = recorded.get("boulder-sweep") if isinstance(recorded, Mapping) else None
    known = isinstance(writer, str) and writer != "unknown"
    by = f"boulder-sweep {shorten(str(writer))}" if known else "an unknown version of boulder-sweep"
    return (
        f"was written by {by} in another format than this version, {versions()['boulder-sweep']}, reads: run it again"
        f"{', or use the version that wrote it' if known else ''}"
    )


def check_identity(there: Mapping[str, Any]) -> None:
    """Check what a result says of itself, before anything is made of it: settings, control, readings and versions.

    Parameters
    ----------
    there
        The identity of the result, see `identity`.

    Raises
    ------
    ValueError
        It holds what no command writes; the text says what.
    """
    from boulder_sweep.settings.stored import check_control, check_stored  # not needed by runs

    for name in ("settings", "control", "readings", "versions"):
        if not isinstance(there.get(name), dict):
            raise ValueError(f"{name} is missing")
    check_stored(there["settings"])
    check_control(there["control"], there["readings"])
    if any(type(version) is not str for version in there["versions"].values()):
        raise ValueError("versions are no text")


def judged_by(there: Mapping[str, Any]) -> str:
    """Say whose rules judged a table; empty where this version has the same rules and kernels.

    Parameters
    ----------
    there
        The identity of the table, see `identity`.
    """
    names = {"rules": rules_sha256, "kernels": kernels_sha256}
    if all(there.get(f"{name}_sha256") == today() for name, today in names.items()):
        return ""
    versions_ = there.get("versions")
    version_ = versions_.get("boulder-sweep", "unknown") if isinstance(versions_, Mapping) else "unknown"
    hashes = ", ".join(f"{name} {shorten(str(there.get(f'{name}_sha256', 'unknown'))[:8])}" for name in names)
    return f"judged by the rules of version {shorten(str(version_))} ({hashes})"


def file_metadata(
    identity_: Mapping[str, Any], repeat: str, firmness: Mapping[str, Any] | None = None
) -> dict[bytes, bytes]:
    """Metadata of a part: its identity, and also command, commit and processor.

    Parameters
    ----------
    identity_
        See `identity`.
    repeat
        Command that computes the same table.
    firmness
        How many verdicts of a sample small changes would change, see `boulder_sweep.judge.firmness`.
    """
    entries = {**identity_, "repeat": repeat, "commit": commit(), "firmness": firmness}
    metadata = {
        f"{PREFIX}{key}".encode(): (value if isinstance(value, str) else canonical(value)).encode(
            errors="backslashreplace"
        )
        for key, value in entries.items()
        if value is not None
    }
    return metadata | cpu_metadata()


def cpu_metadata() -> dict[bytes, bytes]:
    """Metadata of a part that only the worker that computes it knows: its processor."""
    return {f"{PREFIX}cpu".encode(): cpu_name().encode(errors="backslashreplace")}


def new_session(command: str, jobs: int, backend: str) -> Session:
    """Describe the run that starts now."""
    return Session(
        started=now(),
        host=socket.gethostname(),
        pid=os.getpid(),
        cpu=cpu_name(),
        jobs=jobs,
        backend=backend,
        command=command,
    )


def now() -> str:
    """Time in ISO 8601, UTC, to the millisecond."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


@cache
def versions() -> dict[str, str]:
    """Versions of Python, of the packages that compute and write rows, and of the instructions that compute them."""
    from boulder_kernels._cache import target  # imports NumPy, which those who only read a manifest need not

    return {"python": platform.python_version(), "target": target()} | {name: _version(name) for name in _PACKAGES}


def _version(package: str) -> str:
    """Version of a package; "unknown" of a source tree that is not installed.

    It stands in the name of the folder of metadata that an installer makes. Python's reader of such folders is
    imported only where there is none: it takes two megabytes and a twentieth of the time of a short run.
    """
    folders = f"{package.replace('-', '_')}-*.dist-info"
    for path in sys.path:
        for folder in Path(path).glob(folders):
            return folder.stem.partition("-")[2]
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"


@cache
def kernels_sha256() -> str:
    """Hash of the sources of the compiled kernels, as `boulder_kernels.source_hash`, without the import of NumPy."""
    spec = find_spec("boulder_kernels")
    if spec is None or spec.origin is None:
        raise FileNotFoundError("the sources of boulder_kernels are missing")
    return _sources_sha256(sorted(Path(spec.origin).parent.glob("*.py")))


@cache
def rules_sha256() -> str:
    """Hash of the sources that turn settings into designs and outcomes into verdicts."""
    sources = []
    for pattern in _DECIDING_SOURCES:
        paths = sorted(_PACKAGE_FOLDER.glob(pattern))
        if not paths:
            raise FileNotFoundError(f"{_PACKAGE_FOLDER / pattern}: sources that decide a row are missing")
        sources += paths
    return _sources_sha256(sources)


@cache
def cpu_name() -> str:
    """Name of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, "") or platform.processor() or platform.machine()


@cache
def commit() -> str | None:
    """Git commit of the source tree this package runs from; None for an installed package."""
    folder = _PACKAGE_FOLDER.parent
    try:
        if 'name = "boulder-sweep"' not in (folder / "pyproject.toml").read_text(encoding="utf-8"):
            return None
        head = (folder / ".git" / "HEAD").read_text().strip()
        if not head.startswith("ref: "):
            return head
        reference = head.removeprefix("ref: ")
        loose = folder / ".git" / reference
        if loose.exists():
            return loose.read_text().strip()
        packed = (folder / ".git" / "packed-refs").read_text().splitlines()
    except OSError:
        return None
    return next((line.split()[0] for line in packed if line.endswith(f" {reference}")), None)


def _sources_sha256(sources: list[Path]) -> str:
    """Hash over names and contents."""
    digest = hashlib.sha256()
    for source in sources:
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()


_ABSENT = object()


def _flat(content: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Entries of nested mappings under dotted names."""
    entries: dict[str, Any] = {}
    for key, value in content.items():
        if isinstance(value, Mapping):
            entries.update(_flat(value, f"{prefix}{key}."))
        else:
            entries[f"{prefix}{key}"] = value
    return entries


def _shown(entries: Mapping[str, Any], key: str) -> str:
    """Short text of one entry."""
    if key not in entries:
        return "(none)"
    text = json.dumps(entries[key], ensure_ascii=False)
    if key.endswith("_sha256"):
        return text.strip('"')[:12]
    return text if len(text) <= 60 else f"{text[:57]}..."
