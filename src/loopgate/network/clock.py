"""Times as SUMO's files write them: seconds, or days, hours, minutes and seconds with colons between."""

from __future__ import annotations

import math

_SCALES = (1.0, 60.0, 3600.0, 86400.0)


def seconds(text: str) -> float:
    """Return a time in seconds; raise `ValueError` if the text is none."""
    parts = [float(part) for part in text.split(":")]
    total = sum(number * scale for number, scale in zip(reversed(parts), _SCALES, strict=False))
    if len(parts) > len(_SCALES) or not math.isfinite(total):
        msg = f"{text!r} is no time; expected seconds or h:m:s"
        raise ValueError(msg)
    return total
