"""A real browser for tests of pages: Chromium without a window, spoken to over its own protocol."""

from __future__ import annotations

import asyncio
import base64
import json
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tornado.httpclient import AsyncHTTPClient
from tornado.websocket import WebSocketClientConnection, websocket_connect

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None
)
MISSING = "no Chromium is found (chromium, google-chrome): 'make browser' says how to get one"

_FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update", "--remote-debugging-port=0"),
    "--hide-scrollbars",
)
_ANSWER_S = 120
_NOISE = {"Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded"}


class Tab:
    """A tab of a running browser; its calls wait for their answers."""

    def __init__(self, loop: asyncio.AbstractEventLoop, socket: WebSocketClientConnection) -> None:
        self._loop = loop
        self._socket = socket
        self._sent = 0
        self.events: list[dict[str, Any]] = []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **params: object) -> dict[str, Any]:
        """Call a method of the browser's protocol."""
        return self._loop.run_until_complete(self._call(method, params))

    async def _call(self, method: str, params: dict[str, object]) -> dict[str, Any]:
        self._sent += 1
        await self._socket.write_message(json.dumps({"id": self._sent, "method": method, "params": params}))
        while True:
            answer = json.loads(str(await asyncio.wait_for(self._socket.read_message(), _ANSWER_S)))
            if answer.get("id") != self._sent:
                self.events.append(answer)
                continue
            assert "error" not in answer, answer
            result: dict[str, Any] = answer["result"]
            return result

    def value(self, expression: str) -> Any:  # noqa: ANN401  whatever JSON holds
        """Return what an expression is in the page; promises are waited for."""
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def size(self, width: int, height: int) -> None:
        """Set the size of the window [px]."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )

    def open(self, page: Path) -> None:
        """Open a file and wait until it is loaded."""
        self.call("Page.navigate", url=page.as_uri())
        self.value(
            "new Promise(done =>"
            " document.readyState === 'complete' ? done() : addEventListener('load', done))"
        )

    def key(self, key: str, *, shift: bool = False) -> None:
        """Press and release a key."""
        more = {"text": key} if len(key) == 1 else {}
        codes = {"Tab": 9, "Enter": 13, " ": 32}
        code = {"windowsVirtualKeyCode": codes[key]} if key in codes else {}
        for kind in ("keyDown", "keyUp"):
            self.call(
                "Input.dispatchKeyEvent",
                type=kind,
                key=key,
                modifiers=8 if shift else 0,
                **code,
                **(more if kind == "keyDown" else {}),
            )

    def click(self, x: float, y: float) -> None:
        """Click on a point of the window."""
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def screenshot(self, file: Path) -> None:
        """Write what is seen as a PNG."""
        shot = self.call("Page.captureScreenshot", format="png")
        file.write_bytes(base64.b64decode(shot["data"]))

    @property
    def noise(self) -> list[dict[str, Any]]:
        """What went to the console so far."""
        return [event for event in self.events if event["method"] in _NOISE]

    @property
    def requests(self) -> list[str]:
        """What was asked for so far, but for what pages hold themselves."""
        sent = [
            e["params"]["request"]["url"] for e in self.events if e["method"] == "Network.requestWillBeSent"
        ]
        return [url for url in sent if not url.startswith("data:")]


@contextmanager
def open_browser() -> Iterator[Tab]:
    """Start Chromium; it ends with the ``with`` block."""
    assert CHROMIUM is not None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [CHROMIUM, *_FLAGS, f"--user-data-dir={profile}", "about:blank"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as browser:
            loop = asyncio.new_event_loop()
            try:
                assert browser.stderr is not None
                ports = (re.search(r"ws://127.0.0.1:(\d+)/", line) for line in browser.stderr)
                port = next(found[1] for found in ports if found)
                tab = Tab(loop, loop.run_until_complete(_connect(port)))
                yield tab
                tab._socket.close()
            finally:
                loop.close()
                browser.kill()


async def _connect(port: str) -> WebSocketClientConnection:
    listing = await AsyncHTTPClient().fetch(f"http://127.0.0.1:{port}/json")
    target = next(entry for entry in json.loads(listing.body) if entry["type"] == "page")
    return await websocket_connect(target["webSocketDebuggerUrl"], max_message_size=2**28)
