"""The page: one self-contained file with runs, script and style."""

import base64
import hashlib
import html
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

from loopgate.disk import writing
from loopgate.errors import ResultsError
from loopgate.reading import as_path
from loopgate.replay.pack import Pack
from loopgate.replay.scene import Scene, load_scene

MOST_RUNS = 2
"""The most runs that a page shows side by side."""

_SCRIPTS = ("data.js", "waits.js", "view.js", "draw.js", "panel.js", "player.js")
_FRAME_PX = 640


@dataclass(frozen=True, slots=True)
class Replay:
    """A replay of a run as an HTML page, which a notebook shows.

    Attributes
    ----------
    title
        The networks and gates that were run.
    html
        The page as text; it works offline.

    Examples
    --------
    >>> from loopgate import Scenario, run
    >>> roads = {"network": "networks/order2.net.xml", "routes": "routes/order2.rou.xml"}
    >>> replay = run(Scenario(**roads, duration_s=60), "out/moving").replay()
    >>> replay.title
    'order2: loopgate, certified'
    >>> replay.write("out/moving.html").stat().st_size == len(replay.html.encode())
    True
    """

    title: str
    html: str = field(repr=False)

    def write(self, file: Path | str) -> Path:
        """Write the page to a file; return the file's path.

        Raises `ResultsError` if it cannot be written.
        """
        path = Path(file)
        with writing(path):
            if not path.name or path.is_dir():
                msg = f"{file}: a folder; expected the name of a page, such as replay.html"
                raise ResultsError(msg)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(self.html, encoding="utf-8")
        return path

    def _repr_html_(self) -> str:
        page = html.escape(self.html, quote=True)
        return (
            f'<iframe title="{html.escape(self.title)}" srcdoc="{page}" '
            f'style="width:100%;height:{_FRAME_PX}px;border:0"></iframe>'
        )


def make_replay(*folders: Path | str, report: Callable[[int, int], None] | None = None) -> Replay:
    """Return a replay of one run, or of two runs side by side on one clock.

    Raises `ResultsError` if there are not one or two runs, or a run cannot be read or has neither loops nor
    positions; the message names the command to run.

    Parameters
    ----------
    report
        Called with the number of parts done so far, and the number of all parts: a hundred for each run.

    Examples
    --------
    >>> from loopgate import Scenario, make_replay, run
    >>> roads = {"network": "networks/order2.net.xml", "routes": "routes/order2.rou.xml"}
    >>> made = run(Scenario(**roads, duration_s=60), "out/seen")
    >>> make_replay("out/seen").write("out/replay.html").name
    'replay.html'
    """
    if not 1 <= len(folders) <= MOST_RUNS:
        msg = f"a replay shows one run or two side by side; {len(folders)} are given"
        raise ResultsError(msg)
    total = 100 * len(folders)

    def part(before: int, done: int) -> None:
        if report is not None:
            report(before + done, total)

    paths = [as_path(folder, "run folder", ResultsError) for folder in folders]
    scenes = [load_scene(path, partial(part, 100 * n)) for n, path in enumerate(paths)]
    title = ", ".join(dict.fromkeys(scene.network for scene in scenes))
    title = f"{title}: {' beside '.join(scene.name for scene in scenes)}"
    pack = Pack()
    data = pack.text(_description(pack, scenes))
    return Replay(title, _page(title, data))


def _description(pack: Pack, scenes: Sequence[Scene]) -> dict[str, Any]:
    """Return the data of the page as JSON; runs on one network share its streets."""
    streets: list[dict[str, Any]] = []
    runs = []
    for scene in scenes:
        if scene.streets not in streets:
            streets.append(scene.streets)
        runs.append({**scene.describe(pack), "streets": streets.index(scene.streets)})
    return {"streets": streets, "runs": runs}


def _page(title: str, data: str) -> str:
    style, frame = _asset("replay.css"), _asset("replay.html")
    script = '"use strict";\n(() => {\n' + "\n".join(map(_asset, _SCRIPTS)) + "})();\n"
    parts = {
        "{{title}}": html.escape(title),
        "{{policy}}": f"default-src 'none'; script-src {hash_of(script)}; style-src {hash_of(style)}; "
        "img-src data:; base-uri 'none'; form-action 'none'",
        "{{style}}": style,
        "{{script}}": script,
        "{{data}}": data,
    }
    return re.sub(r"\{\{\w+\}\}", lambda found: parts[found[0]], frame)


def _asset(name: str) -> str:
    return (resources.files("loopgate.replay") / "page" / name).read_text(encoding="utf-8")


def hash_of(text: str) -> str:
    """Return the source by which a content security policy lets exactly this script or style in."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
