"""``sweep doctor``: what is installed, and where files are kept, for a look before a question or a report of a bug."""

from __future__ import annotations

import os
import re
import sys
from importlib.metadata import PackageNotFoundError, metadata, version
from pathlib import Path

import click

from boulder_sweep.cli.output import show, wrap

_EXTRA = re.compile(r"extra == ['\"](\w+)['\"]")
PACKAGE = Path(__file__).parents[1]
_DEVELOPERS = ("all", "site", "dev")
"""Extras that are sums of others, or that no command needs."""


@click.command(short_help="Versions, what is not installed, and folders.")
def doctor() -> int:
    """Print versions, extras, browser, compiled kernels and folders of this installation."""
    temporary = os.environ.get("TMPDIR", "/tmp")
    rows = [*_packages(), ("PDF", _browser()), ("kernels", _kernels()), ("temporary files", f"in {temporary}")]
    for name, text in rows:
        show(*wrap(f"{name}: {text}"))
    return 0


def _packages() -> list[tuple[str, str]]:
    """Return a row for this package, Python, what every command needs, and each extra."""
    from boulder_kernels._jit import target
    from boulder_sweep.text import install

    wanted: dict[str, list[str]] = {"": []}
    for line in metadata("boulder-sweep").get_all("Requires-Dist") or ():
        of = _EXTRA.search(line)
        wanted.setdefault(of[1] if of else "", []).append(re.split(r"[^\w.-]", line, maxsplit=1)[0])
    rows = [
        ("boulder-sweep", f"{_version('boulder-sweep')} in {PACKAGE}"),
        ("Python", f"{sys.version.split()[0]} in {sys.prefix}, {os.cpu_count()} cores, {target()}"),
    ]
    for extra, names in wanted.items():
        if extra in _DEVELOPERS:
            continue
        missing = [name for name in names if not _version(name)]
        text = ", ".join(f"{name} {_version(name) or 'missing'}" for name in names)
        rows.append((extra or "packages", f"{text}: {install(extra)}" if missing and extra else text))
    return rows


def _version(package: str) -> str:
    """Return the version of a package; empty where it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def _browser() -> str:
    """Return the browser that prints, or that there is none."""
    from boulder_sweep.errors import ReportError
    from boulder_sweep.report.writing import browser

    try:
        return browser()
    except ReportError as problem:
        return str(problem)


def _kernels() -> str:
    """Return where compiled kernels are kept, and whether some are there."""
    from boulder_kernels._jit import CACHE_FOLDER
    from boulder_sweep.text import size_text

    if CACHE_FOLDER is None:
        return "not kept: every start compiles them"
    compiled = sum(path.stat().st_size for path in Path(CACHE_FOLDER).rglob("*.nbc"))
    return f"{size_text(compiled) + ' compiled' if compiled else 'not compiled yet'}, in {CACHE_FOLDER}"
