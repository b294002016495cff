"""Parts of a page besides its text: Vega-Lite figures, tables as files, the drawing library."""

import base64
import copy
import gzip
import io
import json
from collections.abc import Container, Iterator
from functools import cache
from typing import Any

import pandas as pd
import vl_convert
from markupsafe import Markup

from loopgate.plots.charts import records
from loopgate.plots.style import colours, config
from loopgate.results.csv_text import csv_of, plain

_COLUMN_PT = 245
"""3.4 inches: a column of a page with two."""
_SNIPPET = "window.vegaEmbed = vegaEmbed;"


@cache
def library() -> str:
    """Return Vega, Vega-Lite and Vega-Embed as one script that works offline."""
    version = vl_convert.get_vegalite_versions()[-1]
    script: str = vl_convert.javascript_bundle(_SNIPPET, vl_version=version)
    return script.replace("</script", "<\\/script")


def page_spec(spec: dict[str, Any], description: str, tables: Container[str]) -> dict[str, Any]:
    """Return a figure for the page; `spec` is not used any more.

    Its data are names of `tables`, which the page holds once; its colours follow the page; series that the
    reader switched off (the parameter ``off``) are left out.
    """
    spec = {**spec, "config": config(colours)}
    spec["description"] = description
    spec["params"] = [*spec.get("params", []), {"name": "off", "value": []}]
    spec.setdefault("datasets", {})
    for part in list(_parts(spec)):
        data = part.get("data")
        if isinstance(data, dict) and data.get("name") in tables:
            part["data"] = {"name": data["name"]}
        if "mark" in part:
            part["transform"] = [{"filter": "indexof(off, datum['series']) < 0"}, *part.get("transform", [])]
    return spec


def column_spec(spec: dict[str, Any]) -> dict[str, Any]:
    """Return a figure as broad as a column of a page with two (3.4 inches), its words 7 to 8 points high."""
    narrow: dict[str, Any] = copy.deepcopy(spec)
    look = narrow.setdefault("config", {})
    for part in ("axis", "legend", "header"):
        look[part] = {**look.get(part, {}), "labelFontSize": 7, "titleFontSize": 8}
    look["legend"] |= {"labelLimit": 110, "columnPadding": 6}
    look["title"] = {**look.get("title", {}), "fontSize": 8}
    if "spec" in narrow:
        inner, columns = narrow["spec"], 1 if "usermeta" in narrow else narrow.get("columns", 1)
        breadth = _COLUMN_PT - 12 if "usermeta" in narrow else _COLUMN_PT // max(columns, 1) - 40
        larger = breadth / inner["width"]
        narrow["columns"] = columns
        if "usermeta" in narrow:
            inner["height"] = round(inner["height"] * larger)
            for one in (inner, *inner.get("layer", ())):
                if projection := one.get("projection"):
                    projection["scale"] *= larger
                    projection["translate"] = [shift * larger for shift in projection["translate"]]
        inner["width"] = breadth
    elif "vconcat" in narrow:
        for panel in narrow["vconcat"]:
            panel |= {"width": _COLUMN_PT - 34, "height": 60}
            panel["title"] = {**panel["title"], "fontSize": 8}
    else:
        narrow |= {"width": _COLUMN_PT, "autosize": {"type": "fit-x", "contains": "padding"}}
        narrow["height"] = round(narrow.get("height", 200) * 0.6)
    return narrow


def _parts(part: Any) -> Iterator[dict[str, Any]]:  # noqa: ANN401 - any JSON
    """Yield the views of a figure, from the outermost on."""
    if isinstance(part, dict):
        yield part
        for name in ("layer", "vconcat", "spec"):
            for inner in part[name] if isinstance(part.get(name), list) else [part.get(name)]:
                yield from _parts(inner)


def download(table: pd.DataFrame) -> dict[str, str]:
    """Return the table as CSV (compressed) and Parquet, both as base64."""
    simple = plain(table)
    buffer = io.BytesIO()
    simple.to_parquet(buffer, index=False, compression="zstd")
    packed = gzip.compress(csv_of(table).encode(), mtime=0)
    return {"csv": base64.b64encode(packed).decode(), "parquet": base64.b64encode(buffer.getvalue()).decode()}


def script_json(value: object) -> Markup:
    """Return JSON that can stand inside a script element."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    text = text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
    return Markup(text)  # noqa: S704 - it has no character that could end its element


def rows_of(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows for figures."""
    return records(plain(table))
