"""From a result, or a settings file, to the page on disk, as HTML or printed to PDF by a Chromium on the machine."""

from __future__ import annotations

import dataclasses
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import Any

from boulder_kernels import Control, Readings
from boulder_sweep.columns import BOULDER_MASS
from boulder_sweep.crash_tests.cases import crash_test
from boulder_sweep.errors import ReportError
from boulder_sweep.judge.accuracy import accuracy_of, control_of, readings_of
from boulder_sweep.judge.quantiles import at_values
from boulder_sweep.locations import Location, location_of, replacing
from boulder_sweep.report.answers import NamedDesign, answer_of, screens
from boulder_sweep.report.build import kernel
from boulder_sweep.report.rows import MOST_ELEMENTS, inputs_of, read_rows
from boulder_sweep.settings import Sweep
from boulder_sweep.settings.model import FOOT_WORDS, SolverSettings
from boulder_sweep.settings.sweep import NO_HEADING, SECTION, Heading, units_in, wrong_with
from boulder_sweep.settings.units import check_system, quantity_text
from boulder_sweep.signals import end_group, undone
from boulder_sweep.stones.rock import ROCK_KG_M3
from boulder_sweep.store.folder import check_target
from boulder_sweep.store.provenance import identity as identity_of
from boulder_sweep.store.provenance import versions
from boulder_sweep.text import counted, install, printable, why
from boulder_sweep.views.wording import name_of, value_text

KINDS = (".html", ".htm", ".pdf")
PACKAGES = ("numba", "llvmlite", "numpy", "pyarrow", "python")
BROWSERS = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge", "microsoft-edge"),
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
"""Executables that print, the first found is taken."""
HELP = "write the page as .html and print it from a browser"
MOST_SECONDS = 300
"""After so long a browser that has not printed the page hangs and is ended; it works for five seconds, of which a busy
machine makes minutes."""
WATCHED = 'exec 3<&0; (read _ <&3; kill -9 0) & exec "$@" 3<&- </dev/null'
"""Runs a browser that ends with this process, even if that is killed: its end of a pipe is then closed."""
_LAST_WORDS = 300
"""Characters of what a browser said last that are shown."""
SETTLED_MS = (30_000, 120_000, 480_000)
"""Time of the page that passes before it is printed; the browser skips it while nothing happens, on a busy machine also
while the simulator is still being compiled. A page that was not ready is printed again, later."""
UNREADY = "unready"
"""Title of a page to be printed until its script has filled it; the title stands in the PDF."""


def write_report(
    out: str | Location,
    page: str | Path,
    *,
    designs: Sequence[int] = (),
    units: str | None = None,
    command: str = "",
    heading: Heading = NO_HEADING,
    second_opinion: bool = True,
) -> Path:
    """Write the report of a result: one HTML file that needs no network, or that page printed to PDF.

    Parameters
    ----------
    out
        Folder that a sweep wrote; a run may still be writing into it.
    page
        The file, ``.html``, ``.htm`` or ``.pdf``; replaced if it exists. A PDF is printed by a Chromium on the machine.
    designs
        Rows to be shown in full; by default the one that is recommended.
    units
        Units shown first, ``si`` or ``us``, by default as in the settings file; the reader can switch.
    command
        Command that regenerates the page.
    heading
        Whom and what it is for; an entry that is not given comes from the settings file. The date of a PDF is today's
        where none is given.
    second_opinion
        Whether designs that are shown have a second opinion where the result asked for none.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ReportError
        There is nothing to report, a design does not exist, the page cannot be written or printed, an entry of the
        heading is wrong, the extra ``report`` is not installed, or the kernel of the page was built from other sources.
    StoreError
        There is no result in the folder, or it is damaged.
    ValueError
        The units are unknown.
    """
    if units is not None:
        check_system(units)
    for key, text in heading.given().items():
        if wrong := wrong_with(text):
            raise ReportError(f"--{key.replace('_', '-')}: {wrong}")
    assembled = _page_maker()
    from boulder_sweep.report.sheet import sheet_of  # needs the extra, too

    rows = dataclasses.replace(read_rows(location_of(out)), asks=second_opinion)
    target = checked_page(page)
    if rows.finished.rows_done == 0:
        raise ReportError(f"{out} holds no finished designs yet")
    answer = answer_of(rows)
    try:
        chosen = [_shown(NamedDesign(f"Design {number}", number), rows.row(number)) for number in designs]
    except IndexError as missing:
        raise ReportError(str(missing)) from missing
    given = {k: value for k, value in answer.row.items() if k != BOULDER_MASS or k in rows.settings["inputs"]}
    chosen = chosen or [_shown(answer.named, given)]
    identity = rows.finished.identity
    notes = []
    if rows.finished.judged_by:
        notes.append(
            f"The verdicts of the table were {rows.finished.judged_by}. Simulations in this page follow the rules of "
            f"version {versions()['boulder-sweep']} and may differ from it."
        )
    settings, control = identity["settings"], Control(**identity["control"])
    units = units or units_in(settings)
    readings = Readings(**identity["readings"])
    today = {"date": date.today().isoformat()} if target.suffix.lower() == ".pdf" else {}
    text = assembled(
        heading=Heading(**{**today, **settings.get(SECTION, {}), **heading.given()}).given(),
        settings=settings,
        control=control,
        readings=readings,
        start=chosen[0]["inputs"],
        sheet=sheet_of(rows, answer, units),
        sentences=answer.sentences[answer.need.recommendation is None :],  # the first is then the headline
        answers=screens(rows, answer),
        rows=rows,
        chosen=chosen,
        facts=_facts(identity, command, str(out)),
        notes=[*notes, *_general_notes(settings, control, units)],
        units=units,
    )
    return _written(target, text)


def write_explorer(sweep: Sweep, number: int, page: str | Path, *, units: str | None = None, command: str = "") -> Path:
    """Write the page for one design of a settings file.

    Parameters
    ----------
    sweep
        The checked file.
    number
        Number of the design.
    page, units, command
        See `write_report`.

    Raises
    ------
    ReportError
        There is no such design or it cannot be computed, the page cannot be written, the extra ``report`` is not
        installed, or the kernel of the page was built from other sources.
    ValueError
        The units are unknown.
    """
    target = checked_page(page)
    units = units or sweep.units
    check_system(units)
    sweep = at_values(sweep)
    if not 0 <= number < sweep.n_designs:
        held = counted(sweep.n_designs, "design")
        raise ReportError(f"{sweep.name} holds {held}, numbered from 0; there is no {number}")
    assembled = _page_maker()
    block = sweep.block(number, number + 1)
    if block.reasons[0]:
        raise ReportError(f"design {number} cannot be computed: {block.reasons[0]}")
    inputs = {name: float(column.to_numpy()[0]) for name, column in block.columns.items()}
    settings, control, readings = sweep.resolved(), control_of(sweep, accuracy_of(sweep)), readings_of(sweep)
    text = assembled(
        settings=settings,
        control=control,
        readings=readings,
        start=inputs,
        facts=_facts(identity_of(settings, readings._asdict(), control._asdict()), command),
        notes=_general_notes(settings, control, units),
        units=units,
    )
    return _written(target, text)


def checked_page(path: str | Path) -> Path:
    """Return the path of a page; ReportError where its name has another ending or it cannot be written there."""
    target = Path(path)
    if target.suffix.lower() not in KINDS:
        raise ReportError(f"{path}: the name of a page must end in {', '.join(KINDS[:-1])} or {KINDS[-1]}")
    check_target(target, ReportError)
    return target


def example() -> Sweep:
    """Return a sweep of one design to start from: the paper's second crash test, whose boulder stopped its truck."""
    test = crash_test("rwg")
    return dataclasses.replace(test, solver=SolverSettings())


def _page_maker() -> Callable[..., str]:
    """Return the function that makes the page.

    Raise ReportError where its libraries, an extra, are not installed, or its kernel was built from other sources.
    """
    try:
        from boulder_sweep.report.page import assembled
    except ImportError as lacking:
        raise ReportError(f"reports need {lacking.name}: {install('report')}") from lacking
    kernel()  # refused here, before a result is read and its answer computed
    return assembled


def _shown(one: NamedDesign, row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row as the page shows it."""
    return {"title": one.title, "number": one.number, "inputs": inputs_of(row), "shape": row.get("shape")}


def _general_notes(settings: Mapping[str, Any], control: Control, units: str) -> list[str]:
    """Return notes on how these designs are simulated, in the units asked for."""
    notes = [f"{FOOT_WORDS[settings['model']['foot']].replace(' (boulder.foot)', '').capitalize()}."]
    if settings["model"].get("rock_assumed"):
        rock = quantity_text("kg/m^3", units, ROCK_KG_M3)
        notes.append(f"The density of the rock was not given: {rock} is assumed, and no pass is robust.")
    if taken := [_taken(name, how, settings["inputs"], units) for name, how in settings.get("taken_at", {}).items()]:
        judged = "; every design has the worst verdict at these, the means and the other ends"
        notes.append(f"Uncertain inputs are taken at {', '.join(taken)}{judged if 'judged_at' in settings else ''}.")
    for factor in settings.get("partial_factor", {}).values():
        notes.append(f"Friction angles are design values, with a partial factor of {factor:g} on their tangent.")
    if not control.error_estimate:
        notes.append(
            "Numerical errors are estimated from one solution: a verdict nearer to a limit than that is undecided."
        )
    if control.elements > MOST_ELEMENTS:
        notes.append(
            f"The settings ask for {control.elements:,} soil elements; what is simulated in this page uses "
            f"{MOST_ELEMENTS:,}, which differ little from more."
        )
    return notes


def _taken(name: str, how: str, inputs: Mapping[str, Any], units: str) -> str:
    """Return at which quantile an uncertain input was taken, with its value if that is the same in all designs."""
    value, (at, _, side) = inputs.get(name), how.partition(" ")
    which = f"{'lower' if side == 'low' else 'upper'} {at[1:]} %" if side else at
    return f"{value_text(name, value, units) if isinstance(value, float) else name_of(name)} ({which})"


def _facts(identity: Mapping[str, Any], command: str, out: str = "") -> list[tuple[str, str]]:
    """Return the origin of the results, and how to reproduce them."""
    used = identity["versions"]
    facts = [("version of boulder-sweep", used.get("boulder-sweep", "unknown"))]
    facts.append(("other versions", ", ".join(f"{name} {used[name]}" for name in PACKAGES if name in used)))
    facts += [(f"hash of the {what}", identity[f"{what}_sha256"]) for what in ("settings", "kernels")]
    return [*facts, *((name, printable(text)) for name, text in (("table", out), ("command", command)) if text)]


def _written(page: Path, text: str) -> Path:
    """Write the page, or print it to PDF, as a whole or not at all; ReportError where that is refused."""
    content = printed(text) if page.suffix.lower() == ".pdf" else text.encode()
    try:
        with replacing(page) as file:
            file.write(content)
    except OSError as problem:
        raise ReportError(f"{page} cannot be written: {why(problem)}") from problem
    return page


def browser() -> str:
    """Return the executable of a Chromium; ReportError where there is none."""
    named = next(filter(None, map(shutil.which, BROWSERS)), None)
    if not named:
        raise ReportError(f"a PDF is printed by Chromium, which was not found: install Chromium or Chrome, or {HELP}")
    return named


def printed(html: str) -> bytes:
    """Return a page as PDF; ReportError where there is no Chromium, or it does not print the page."""
    program = browser()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        page, target = Path(folder, "page.html"), Path(folder, "page.pdf")
        head, _, rest = html.partition("<title>")
        page.write_text(f"{head}<title>{UNREADY}{rest[rest.find('</title>') :]}" if rest else html, encoding="utf-8")
        # As root, as in a container, Chromium does not start with its sandbox.
        as_root = hasattr(os, "geteuid") and os.geteuid() == 0
        words = [
            program,
            "--headless",
            "--disable-gpu",
            "--disable-dev-shm-usage",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            *(["--no-sandbox"] if as_root else []),
            f"--user-data-dir={Path(folder, 'profile')}",
            "--no-pdf-header-footer",
            "--window-size=1200,900",
            f"--print-to-pdf={target}",
            f"{page.as_uri()}#paper",
        ]
        for settled in SETTLED_MS:
            budget = f"--virtual-time-budget={settled}"
            code, said = _ended(program, [*words[:-1], budget, words[-1]], Path(folder, "said"))
            if not target.exists() or not target.stat().st_size:
                shown = f": {said}" if said else ""
                raise ReportError(f"{program} did not print the page (it ended with code {code}{shown}); {HELP}")
            content = target.read_bytes()
            if f"/Title ({UNREADY})".encode() not in content:
                return content
    raise ReportError(f"the page was not ready when {program} printed it; {HELP}")


def _ended(program: str, words: Sequence[str], said: Path) -> tuple[int, str]:
    """Run a browser to its end; return its exit code, and the end of what it said, which goes into a file.

    No process is left behind. Raise ReportError where it does not start, or not end in time.
    """
    # Otherwise it leaves a socket among the user's temporary files, whose path must be short, and settings elsewhere.
    environment = {**os.environ, "TMPDIR": ".", "GSETTINGS_BACKEND": "memory"}

    def start() -> subprocess.Popen[bytes]:
        # In a group of its own: a browser is many processes, which outlive the first where that alone is ended.
        return subprocess.Popen(
            ["/bin/sh", "-c", WATCHED, program, *words],
            cwd=said.parent,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=said_in,
            stderr=said_in,
            start_new_session=True,
        )

    try:
        with said.open("wb") as said_in, undone(start, end_group) as running:
            code = running.wait(MOST_SECONDS)
    except OSError as problem:
        raise ReportError(f"{program} does not start ({why(problem)}); {HELP}") from problem
    except subprocess.TimeoutExpired:
        raise ReportError(f"{program} did not print the page within {MOST_SECONDS} s; {HELP}") from None
    with said.open("rb") as file:
        file.seek(max(said.stat().st_size - 4 * _LAST_WORDS, 0))
        last = " ".join(file.read(4 * _LAST_WORDS).decode(errors="replace").split())
    return code, printable(last[-_LAST_WORDS:])
