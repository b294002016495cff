"""Pages open by themselves where there is a browser."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import pytest

from loopgate.cli.terminal import open_page


@pytest.mark.parametrize("there", [True, False])
def test_the_page_is_opened_or_named(
    there: bool,  # noqa: FBT001  a case
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """By an address that works from everywhere."""
    asked: list[str] = []

    def opened(address: str) -> bool:
        asked.append(address)
        return there

    monkeypatch.setattr(webbrowser, "open", opened)
    page = tmp_path / "a page.html"
    open_page(page)
    assert asked == [page.as_uri()]
    assert (str(page) in capsys.readouterr().err) is not there
