"""The Parquet types of a results table."""

import pyarrow as pa

from loopgate.results.row_columns import HELD

_TYPES = {"list<float>": pa.list_(pa.float32()), "timestamp[ms, UTC]": pa.timestamp("ms", tz="UTC")}

ROW_SCHEMA = pa.schema([(name, _TYPES.get(held, held)) for name, held in HELD.items()])
