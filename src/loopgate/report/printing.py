"""Prints a page of ours to a PDF file by a browser that is installed."""

import os
import shutil
import subprocess
from pathlib import Path

from loopgate.errors import ResultsError
from loopgate.folders import temporary_folder

_BROWSERS = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "msedge"),
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
)
_QUIET = (
    *("--headless", "--disable-gpu", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--no-pdf-header-footer"),
)
_DRAWS_MS = 15_000
"""Time by the page's clock in which it draws its figures [ms]; the browser does not wait that long."""
_LONGEST_S = 120.0


def print_page(page: Path, pdf: Path) -> None:
    """Print a report to a PDF file: its words and figures, without its tables.

    Raises `ResultsError` if there is no browser, or it writes nothing.
    """
    browser = next((found for name in _BROWSERS if (found := shutil.which(name))), None)
    if browser is None:
        msg = f"{pdf}: no browser to print it (chromium, google-chrome or msedge); print {page} from yours"
        raise ResultsError(msg)
    pdf.parent.mkdir(parents=True, exist_ok=True)
    pdf.unlink(missing_ok=True)
    # A browser in a container runs as root, and refuses to without this.
    alone = ["--no-sandbox"] if getattr(os, "geteuid", lambda: 1)() == 0 else []
    with temporary_folder() as profile:
        words = [browser, *_QUIET, *alone, f"--user-data-dir={profile}"]
        words += [f"--virtual-time-budget={_DRAWS_MS}", f"--print-to-pdf={pdf.resolve()}"]
        url = f"{page.resolve().as_uri()}#brief"
        try:
            done = subprocess.run([*words, url], capture_output=True, timeout=_LONGEST_S, check=False)  # noqa: S603
        except (OSError, subprocess.TimeoutExpired) as error:
            msg = f"{pdf}: {browser} did not print the page ({type(error).__name__})"
            raise ResultsError(msg) from error
    if not pdf.is_file():
        last = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
        msg = f"{pdf}: {browser} did not print the page ({''.join(last)[:200]})"
        raise ResultsError(msg)
