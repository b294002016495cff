"""The page in a real browser: nothing on the console, no request, nothing cut off, a PDF."""

import asyncio
import base64
import json
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tornado.httpclient import AsyncHTTPClient
from tornado.websocket import websocket_connect

from loopgate.report.page import write_report
from loopgate.runs.results import Results

Make = Callable[..., Results]

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update", "--remote-debugging-port=0"),
)
FULL = {"vehicles": [10, 40, 80], "gate": ["open", "certified"], "seed": [1, 2, 3]}

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning"),
]


@pytest.mark.parametrize("width", [1280, 375])
def test_in_a_browser(width: int, make: Make, tmp_path: Path) -> None:
    """At desktop and phone width: quiet console, one request (the page), no sideways scrolling."""
    page = write_report(make(FULL), tmp_path / "r.html").page
    seen = look(page, width)
    assert seen["problems"] == []
    assert seen["requests"] == [page.as_uri()]
    assert seen["page_width"] <= width
    assert seen["cut"] == []
    assert seen["pdf"].startswith(b"%PDF")
    assert seen["copied"].startswith("series\tvehicles\truns\tmean")


def look(page: Path, width: int) -> dict[str, Any]:
    """Open the page and return what the browser saw; its screenshot and PDF go beside the page."""
    assert CHROMIUM is not None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [CHROMIUM, *FLAGS, f"--user-data-dir={profile}", "about:blank"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as browser:
            try:
                assert browser.stderr is not None
                ports = (re.search(r"ws://127.0.0.1:(\d+)/", line) for line in browser.stderr)
                port = next(found[1] for found in ports if found)
                return asyncio.run(_visit(port, page, width))
            finally:
                browser.kill()


async def _visit(port: str, page: Path, width: int) -> dict[str, Any]:
    listing = await AsyncHTTPClient().fetch(f"http://127.0.0.1:{port}/json")
    target = next(entry for entry in json.loads(listing.body) if entry["type"] == "page")
    socket = await websocket_connect(target["webSocketDebuggerUrl"], max_message_size=2**28)
    events: list[dict[str, Any]] = []
    sent = 0

    async def call(method: str, **params: object) -> dict[str, Any]:
        nonlocal sent
        sent += 1
        await socket.write_message(json.dumps({"id": sent, "method": method, "params": params}))
        while True:
            answer = json.loads(str(await asyncio.wait_for(socket.read_message(), 30)))
            if answer.get("id") == sent:
                assert "error" not in answer, answer
                result: dict[str, Any] = answer["result"]
                return result
            events.append(answer)

    async def value(expression: str) -> Any:  # noqa: ANN401 - whatever JSON holds
        answer = await call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    for domain in ("Page", "Runtime", "Log", "Network"):
        await call(f"{domain}.enable")
    await call(
        "Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 600
    )
    await call("Page.navigate", url=page.as_uri())
    loaded = (
        "new Promise(done => document.readyState === 'complete' ? done() : addEventListener('load', done))"
    )
    await value(loaded)
    page_width = await value("document.documentElement.scrollWidth")
    height = await value("document.documentElement.scrollHeight")
    clip = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
    shot = await call("Page.captureScreenshot", format="png", captureBeyondViewport=True, clip=clip)
    page.with_name(f"{page.stem}-{width}.png").write_bytes(base64.b64decode(shot["data"]))
    cut = await value(
        "[...document.querySelectorAll('h1,h2,h3,p,figure,pre,summary')]"
        ".filter(e => e.getBoundingClientRect().right > innerWidth + 1).map(e => e.outerHTML.slice(0, 80))"
    )
    copied = await value(
        "(() => { let text = ''; const b = document.querySelector('button[data-copy]');"
        "Object.defineProperty(navigator, 'clipboard', {value: {writeText: t => { text = t; }}});"
        "b.click(); return text; })()"
    )
    pdf = base64.b64decode((await call("Page.printToPDF"))["data"])
    page.with_suffix(".pdf").write_bytes(pdf)
    socket.close()
    return {
        "problems": [
            event
            for event in events
            if event["method"] in {"Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded"}
        ],
        "requests": [
            url
            for event in events
            if event["method"] == "Network.requestWillBeSent"
            and not (url := event["params"]["request"]["url"]).startswith("data:")
        ],
        "page_width": page_width,
        "cut": cut,
        "copied": copied,
        "pdf": pdf,
    }
