"""Numbers of Arrow's columns as NumPy arrays. Arrow's own ways there load pandas, which costs more than a short log."""

from __future__ import annotations

from typing import Any

import numpy as np

from svo.checks import Array


def numbers_of(column: Any) -> Array:
    """Floats (rows,) of an array, chunked or not, of integers or floats; NaN where it is null."""
    chunks = [column] if not hasattr(column, "chunks") else column.chunks
    return np.concatenate([np.zeros(0), *map(_numbers, chunks)])


def _numbers(chunk: Any) -> Array:
    validity, data = chunk.buffers()
    first, rows, kind = chunk.offset, len(chunk), np.dtype(chunk.type.to_pandas_dtype())
    if not rows:
        return np.zeros(0)
    values = np.frombuffer(data, kind, rows, first * kind.itemsize).astype(float)
    if chunk.null_count:
        is_there = np.unpackbits(np.frombuffer(validity, np.uint8), bitorder="little")[first : first + rows]
        values[is_there == 0] = np.nan
    return values
