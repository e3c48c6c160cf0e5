"""A page on paper: printed to PDF by a Chromium that is on the machine."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from boulder_sweep.errors import ReportError
from boulder_sweep.store.files import put_file
from boulder_sweep.text import why

BROWSERS = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge", "microsoft-edge"),
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
"""Executables that print, the first found is taken."""
PLAYWRIGHT = (
    "chromium-*/chrome-linux*/chrome",
    "chromium-*/chrome-mac*/*.app/Contents/MacOS/*",
    "chromium-*/*/chrome.exe",
)
"""Where Playwright keeps its browser, within its folder."""
PLAYWRIGHT_FOLDERS = (".cache/ms-playwright", "Library/Caches/ms-playwright", "AppData/Local/ms-playwright")
HELP = "install Chromium or Chrome, or write the page as .html and print it from a browser"
MOST_SECONDS = 600
"""After so long a browser that has not printed the page hangs and is ended; it works for five seconds, of which a busy
machine makes minutes."""
SETTLED_MS = 30_000
"""Time of the page that passes before it is printed; the browser skips it while nothing happens."""


def browser() -> str:
    """Return the executable of a Chromium.

    Raises
    ------
    ReportError
        There is none.
    """
    named = next(filter(None, map(shutil.which, BROWSERS)), None)
    if named:
        return named
    folders = [Path.home() / folder for folder in PLAYWRIGHT_FOLDERS]
    found = [path for folder in folders for pattern in PLAYWRIGHT for path in sorted(folder.glob(pattern))]
    if not found:
        raise ReportError(f"a PDF is printed by Chromium, which was not found: {HELP}")
    return str(found[-1])


def print_page(html: str, target: Path) -> None:
    """Print a page.

    Parameters
    ----------
    html
        The page.
    target
        The PDF; written as a whole or not at all.

    Raises
    ------
    ReportError
        There is no Chromium, it does not print the page, or the file cannot be written.
    """
    program = browser()
    with tempfile.TemporaryDirectory(prefix="boulder-sweep-", ignore_cleanup_errors=True) as folder:
        page, printed = Path(folder, "page.html"), Path(folder, "page.pdf")
        page.write_text(html, encoding="utf-8")
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
            f"--virtual-time-budget={SETTLED_MS}",
            "--window-size=1200,900",
            f"--print-to-pdf={printed}",
            page.as_uri(),
        ]
        try:
            ended = subprocess.run(words, capture_output=True, timeout=MOST_SECONDS, check=False)
        except subprocess.TimeoutExpired:
            raise ReportError(f"{program} did not print the page within {MOST_SECONDS} s: {HELP}") from None
        except OSError as problem:
            raise ReportError(f"{program} does not start ({why(problem)}): {HELP}") from problem
        if not printed.exists() or not printed.stat().st_size:
            raise ReportError(f"{program} did not print the page (it ended with code {ended.returncode}): {HELP}")
        try:
            put_file(target.parent, target.name, printed.read_bytes())
        except OSError as problem:
            raise ReportError(f"{target} cannot be written: {why(problem)}") from problem
