"""The Parquet types of a results table."""

import pyarrow as pa

from loopgate.results.columns import HELD
from loopgate.results.figures import FIGURES

_TYPES = {"list<float>": pa.list_(pa.float32()), "timestamp[ms, UTC]": pa.timestamp("ms", tz="UTC")}

_HELD = HELD | {figure.keys: figure.holds for figure in FIGURES if figure.holds}

ROW_SCHEMA = pa.schema([(name, _TYPES.get(held, held)) for name, held in _HELD.items()])
