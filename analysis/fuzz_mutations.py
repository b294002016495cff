"""Ways to spoil a valid input, by chance and the same for the same seed."""

from __future__ import annotations

import gzip
import io
import json
import re
from random import Random
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

_DEEP = 100_000
_LONG = 300
NASTY: tuple[Any, ...] = (
    *(float("nan"), float("inf"), float("-inf"), -1, 0, 1e308, -1e308, 1e-320, 1.5, True, None),
    *(10**18, 2**31, 2**63, -(2**63), 10**400, 99999999999),
    *("", " ", "nan", "../../x", "x" * _LONG, "x/" * _LONG, "\N{SNOWMAN}", "\x00", "a\nb", "\ud800", "1"),
    *([], {}, [[]], [None], {"": ""}, ["a", 1]),
)
"""Values that somebody will give one day."""

_WORDS = (
    *(
        "nan",
        "inf",
        "-inf",
        "-1",
        "0",
        "1e308",
        "1e-320",
        "9" * 5000,
        "0x" + "f" * 5000,
        "99999999999999999999",
    ),
    *("", "true", "null", "[]", "{}", "../../x", "x" * _LONG, "\N{SNOWMAN}", "\ufeff", "&#0;", "1979-05-27"),
    *("[" * _DEEP, "{" * 500, "<a>" * _DEEP, '"', "'", "=", "[[", "]]", "\x00", "\x1f\x8b", "PAR1", "\r"),
)
_PLAIN = (
    *(
        b"nan",
        b"inf",
        b"-inf",
        b"-1",
        b"0",
        b"1",
        b"7",
        b"0.5",
        b"1e308",
        b"-1e308",
        b"1e-320",
        b"99999999999999999999",
    ),
    *(
        b"",
        b" ",
        b"x",
        b"../../x",
        b"x" * _LONG,
        b"1,2",
        b"nan,nan",
        b"inf,1",
        b":",
        b"_0",
        b"true",
        b"1" * 5000,
    ),
)
"""Values of an attribute, a part of one, or a text."""

_TOML = (
    *(b"nan", b"-inf", b"-1", b"0", b"1.5", b"1e308", b"99999999999999999999", b"0x" + b"f" * 5000, b"true"),
    *(b'""', b'"x"', b'"../../x"', b'"' + b"x" * _LONG + b'"', b'"\\u0000"', b"[]", b"[1]", b"[nan]", b"{}"),
    *(
        b"{ from = 0, to = 99999999999 }",
        b"{ from = 5 }",
        b"1979-05-27",
        b"[" * 300 + b"]" * 300,
        b'"certifed"',
    ),
)
_TOKEN = re.compile(rb'"[^"\n]*"|[-+]?[0-9][0-9.eE+-]*|[A-Za-z_][\w.:#-]*')
_VALUE = re.compile(rb'"[^"\n]*"|(?<![\w."])[-+]?[0-9][0-9.eE+-]*')
_ENCODINGS = (b"none-such", b"utf-16", b"utf-7", b"idna", b"cp037", b"", b"big5", b"hex")


def spoiled(name: str, content: bytes, random: Random) -> bytes:
    """Return the content of a file with one to three faults; its name says what kind of file it is."""
    if name.endswith(".gz") and random.random() < 0.7:  # noqa: PLR2004  else the packed bytes are spoiled
        return gzip.compress(spoiled(name[:-3], gzip.decompress(content), random), 1)
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        content = _once(name, content, random)
    return content


def _once(name: str, content: bytes, random: Random) -> bytes:
    structured = {
        ".json": _json,
        ".jsonl": _json_line,
        ".parquet": _parquet,
        ".sumocfg": _attribute,
        ".toml": _entry,
        ".xml": _attribute,
    }
    ending = "." + name.rpartition(".")[2]
    if ending in structured and random.random() < 0.6:  # noqa: PLR2004  more often so than not
        try:
            return structured[ending](content, random)
        except Exception:  # noqa: BLE001  it was spoiled before, or holds what this format cannot write
            return content[:-1]
    if ending == ".parquet":
        return random.choice((_flip, _flip, _flip, _cut, _repeat))(content, random)
    return random.choice(_WAYS)(content, random)


def spoiled_value(data: Any, random: Random) -> Any:  # noqa: ANN401  any JSON value
    """Return data of lists and mappings with one part replaced, left out, doubled or renamed."""
    inner = isinstance(data, list | dict) and data and random.random() < 0.85  # noqa: PLR2004  go deeper
    if not inner:
        return random.choice(NASTY)
    keys = list(data) if isinstance(data, dict) else range(len(data))
    key = random.choice(keys)
    changed = data.copy()
    way = random.random()
    if way < 0.1:  # noqa: PLR2004  a share
        del changed[key]
    elif way < 0.15 and isinstance(data, dict):  # noqa: PLR2004  as above
        changed[random.choice((*keys, "", "x", "\x00"))] = changed.pop(key)
    elif way < 0.2 and isinstance(data, list):  # noqa: PLR2004  as above
        changed.append(changed[key])
    else:
        changed[key] = spoiled_value(data[key], random)
    return changed


def _attribute(content: bytes, random: Random) -> bytes:
    """Spoil an attribute or leave out an element, and leave the file XML."""
    if random.random() < 0.1:  # noqa: PLR2004  a share
        elements = list(re.finditer(rb"<[a-zA-Z][^<>]*/>", content))
        return _without(content, random.choice(elements)) if elements else b""
    found = list(re.finditer(rb'\s([\w-]+)="([^"<]*)"', content))
    if not found:
        return content[:-1]
    one, other = random.choice(found), random.choice(found)
    way = random.random()
    if way < 0.1:  # noqa: PLR2004  as above
        return _without(content, one)
    if way < 0.3:  # noqa: PLR2004  as above
        value = other[2]
    elif way < 0.6 and b" " in one[2]:  # noqa: PLR2004  as above
        parts = one[2].split()
        parts[random.randrange(len(parts))] = random.choice((*parts, *_PLAIN))
        value = b" ".join(parts)
    else:
        value = random.choice(_PLAIN)
    return content[: one.start(2)] + value + content[one.end(2) :]


def _entry(content: bytes, random: Random) -> bytes:
    """Spoil a value, and leave the file TOML."""
    found = list(re.finditer(rb'"[^"\n]*"|(?<![\w."])[-+]?[0-9][0-9.]*', content))
    if not found:
        return content[:-1]
    one = random.choice(found)
    value = random.choice((*_TOML, *(other[0] for other in found)))
    return content[: one.start()] + value + content[one.end() :]


def _without(content: bytes, part: re.Match[bytes]) -> bytes:
    return content[: part.start()] + content[part.end() :]


def _json(content: bytes, random: Random) -> bytes:
    return json.dumps(spoiled_value(json.loads(content), random)).encode()


def _json_line(content: bytes, random: Random) -> bytes:
    lines = content.splitlines()
    number = random.choice((0, random.randrange(len(lines))))
    lines[number] = _json(lines[number], random)
    return b"\n".join(lines)


def _parquet(content: bytes, random: Random) -> bytes:
    frame = pq.read_table(io.BytesIO(content)).to_pandas()
    column = random.choice(list(frame.columns))
    values = frame[column].astype(object)
    nasty = random.choice(NASTY)
    way = random.randrange(6)
    if way == 0:
        frame = frame.drop(columns=column)
    elif way == 1:
        frame = frame.rename(columns={column: random.choice((*frame.columns, "x"))})
    elif way == 2:  # noqa: PLR2004  the ways are numbered
        frame = frame.head(0)
    elif way == 3:  # noqa: PLR2004  as above
        frame[column] = pd.Series([nasty] * len(frame), dtype=object)
    elif way == 4 and len(frame):  # noqa: PLR2004  as above
        values.iloc[random.randrange(len(frame))] = nasty
        frame[column] = values
    else:
        frame[column] = values.astype(str)
    buffer = io.BytesIO()
    table = pa.Table.from_pandas(frame, preserve_index=False)
    pq.write_table(table, buffer)
    return buffer.getvalue()


def _flip(content: bytes, random: Random) -> bytes:
    changed = bytearray(content)
    for _ in range(random.choice((1, 1, 4, 32)) if changed else 0):
        changed[random.randrange(len(changed))] = random.randrange(256)
    return bytes(changed)


def _cut(content: bytes, random: Random) -> bytes:
    begin, end = sorted(random.randrange(len(content) + 1) for _ in range(2))
    return random.choice((content[:begin], content[:begin] + content[end:], content[begin:], b""))


def _repeat(content: bytes, random: Random) -> bytes:
    begin, end = sorted(random.randrange(len(content) + 1) for _ in range(2))
    return content[:end] + content[begin:]


def _insert(content: bytes, random: Random) -> bytes:
    at = random.randrange(len(content) + 1)
    return content[:at] + random.choice(_WORDS).encode() + content[at:]


def _replace(content: bytes, random: Random) -> bytes:
    found = list(random.choice((_TOKEN, _VALUE, _VALUE)).finditer(content))
    if not found:
        return _insert(content, random)
    token = random.choice(found)
    word = random.choice((*_WORDS, random.choice(found)[0].decode(errors="replace"))).encode()
    if token[0].startswith(b'"') and random.random() < 0.9:  # noqa: PLR2004  else the quotes go too
        word = b'"' + word.strip(b'"') + b'"'
    return content[: token.start()] + word + content[token.end() :]


def _line(content: bytes, random: Random) -> bytes:
    lines = content.splitlines(keepends=True)
    if not lines:
        return b"\n"
    one, other = random.randrange(len(lines)), random.randrange(len(lines))
    way = random.randrange(3)
    if way == 0:
        del lines[one]
    elif way == 1:
        lines.insert(other, lines[one])
    else:
        lines[one], lines[other] = lines[other], lines[one]
    return b"".join(lines)


def _encode(content: bytes, random: Random) -> bytes:
    if b"encoding=" in content[:100]:
        return re.sub(
            rb'encoding="[^"]*"', b'encoding="' + random.choice(_ENCODINGS) + b'"', content, count=1
        )
    return content.decode(errors="replace").encode(random.choice(("utf-16", "utf-8-sig", "utf-32")))


_WAYS = (
    _flip,
    _cut,
    _repeat,
    _insert,
    _replace,
    _replace,
    _replace,
    _replace,
    _replace,
    _line,
    _line,
    _encode,
)


def spoiled_word(word: str, random: Random) -> str:
    """Return a word of a command line, or a name with options, with a fault."""
    content = _replace(word.encode(), random) if random.random() < 0.7 else _flip(word.encode(), random)  # noqa: PLR2004
    return content.decode(errors="replace").replace("\x00", "0")[: _LONG * 10]
