"""Settings and code behind a table.

The *identity* is what must be equal for rows to belong to one table: settings, control of the integration, versions,
the instructions of the processor that decide bits, and the hashes of the code that decides a row. It goes into every
part, and a run is resumed only with the same; the heading of reports, on which no row depends, may change. When, where
and with how many workers rows were computed does not affect them, and is not kept.
"""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from boulder_sweep.settings.problems import shorten
from boulder_sweep.settings.sweep import SHOWN

PREFIX = "boulder_sweep."
"""Prefix of this package's entries in the metadata of a file."""
FORMAT = 4
"""Version of the format of tables and answers: one more whenever a column or entry comes, goes or changes meaning."""
_PACKAGES = ("boulder-sweep", "numpy", "numba", "llvmlite", "pyarrow")
_PACKAGE_FOLDER = Path(__file__).resolve().parents[1]
_DECIDING_SOURCES = (
    "designs.py",
    "columns.py",
    "elementary.py",
    "soils.py",
    "investigation.py",
    "judge/*.py",
    *(f"settings/{name}.py" for name in ("fields", "model")),
    *(f"stones/{name}.py" for name in ("rock", "taped")),
)
"""Modules, in addition to the kernels, whose code determines the rows: of settings and stones what others import."""
_JSON = {"format", "settings", "readings", "control", "accuracy", "versions"} | {
    *("rows", "ranges", "range", "verdicts"),  # of parts only
}
"""Entries of the metadata that are JSON."""
_OWN = tuple(f"{PREFIX}{name}".encode() for name in ("range", "verdicts"))
"""Entries in which the parts of a table differ."""
_DEEPEST = 32
"""Most levels of nested records; a settings file has fewer than ten."""


def canonical(content: Any) -> str:
    """JSON that is the same text for the same content."""
    return json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def sha256_of(content: Any) -> str:
    """SHA-256 of the canonical JSON of some content."""
    return hashlib.sha256(canonical(content).encode()).hexdigest()


def settings_sha256(settings: Mapping[str, Any]) -> str:
    """SHA-256 of resolved settings without the heading of reports, on which no row depends."""
    return sha256_of({key: value for key, value in settings.items() if key not in SHOWN})


def identity(
    settings: Mapping[str, Any],
    readings: Mapping[str, Any],
    control: Mapping[str, Any],
    accuracy: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Collect what all rows of one table have in common, as plain data.

    Settings are resolved: every default filled in, units in the names. The readings say which formulas are read as
    printed, the control how the motion is integrated, the accuracy what was requested, and its steps.
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
    changed = [key for key in changed if key.split(".")[:2] not in [["settings", name] for name in SHOWN]]
    telling = [key for key in changed if not key.endswith("_sha256")]
    if any(key.startswith("settings.") for key in telling):
        changed = [key for key in changed if key != "settings_sha256"]
    return [f"{key}: {_shown(before, key)} -> {_shown(after, key)}" for key in changed]


def identity_in(metadata: Mapping[bytes, bytes] | None) -> dict[str, Any]:
    """Return the identity in the metadata of a file, and what else `file_metadata` wrote; empty of another file.

    Raise ValueError or RecursionError where it holds what no command writes.
    """
    texts = {key.decode(errors="replace"): value for key, value in (metadata or {}).items()}
    entries = {key.removeprefix(PREFIX): value for key, value in texts.items() if key.startswith(PREFIX)}
    parsed = {key: json.loads(value) if key in _JSON else value.decode() for key, value in entries.items()}
    if _is_deep(parsed):
        raise ValueError("its records are nested too deeply")
    canonical(parsed).encode()  # JSON can escape what is no text
    return parsed


def common_in(metadata: Mapping[bytes, bytes] | None) -> dict[bytes, bytes]:
    """Return the metadata that all parts of a table have in common."""
    return {key: value for key, value in (metadata or {}).items() if not is_own(key)}


def is_own(key: bytes) -> bool:
    """Whether an entry of the metadata is one in which the parts of a table differ."""
    return key in _OWN


def _is_deep(content: Any) -> bool:
    """Whether records are nested so deeply that functions that call themselves could fail."""
    level = [content]
    for _ in range(_DEEPEST):
        nested = [one.values() if isinstance(one, dict) else one for one in level if isinstance(one, dict | list)]
        level = [value for values in nested for value in values]
    return bool(level)


def other_version(there: Any) -> str:
    """Say which version wrote a result that this one does not read, and what to do; empty of a result that it reads.

    The identity of a stranger's result may be anything at all.
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
    """Check the identity of a result before anything is made of it: settings, control, readings and versions.

    Raise ValueError, which says what it holds that no command writes.
    """
    from boulder_sweep.settings.stored import check_control, check_stored  # not needed by runs

    for name in ("settings", "control", "readings", "versions"):
        if not isinstance(there.get(name), dict):
            raise ValueError(f"{name} is missing")
    if not isinstance(there.get("accuracy", {}), dict):
        raise ValueError("accuracy is no record")
    check_stored(there["settings"])
    check_control(there["control"], there["readings"])
    if any(type(version) is not str for version in there["versions"].values()):
        raise ValueError("versions are no text")


def judged_by(there: Mapping[str, Any]) -> str:
    """Say whose rules judged a table of this identity; empty where this version has the same rules and kernels."""
    names = {"rules": rules_sha256, "kernels": kernels_sha256}
    if all(there.get(f"{name}_sha256") == today() for name, today in names.items()):
        return ""
    versions_ = there.get("versions")
    version_ = versions_.get("boulder-sweep", "unknown") if isinstance(versions_, Mapping) else "unknown"
    hashes = ", ".join(f"{name} {shorten(str(there.get(f'{name}_sha256', 'unknown'))[:8])}" for name in names)
    return f"judged by the rules of version {shorten(str(version_))} ({hashes})"


def file_metadata(identity_: Mapping[str, Any], **more: Any) -> dict[bytes, bytes]:
    """Metadata of a file: the identity of its rows, and more entries by name; None for none.

    Of a part: ``rows`` of its table and the number of its ``ranges``. Of answers: the command that would ``repeat``
    them.
    """
    return {
        f"{PREFIX}{key}".encode(): (value if isinstance(value, str) else canonical(value)).encode(
            errors="backslashreplace"
        )
        for key, value in {**identity_, **more}.items()
        if value is not None
    }


@cache
def versions() -> dict[str, str]:
    """Versions of Python, of the packages that compute and write rows, and of the instructions that compute them."""
    from boulder_kernels._jit import target

    return {"python": platform.python_version(), "target": target()} | {name: _version(name) for name in _PACKAGES}


def _version(package: str) -> str:
    """Version of a package; "unknown" of a source tree that is not installed."""
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
