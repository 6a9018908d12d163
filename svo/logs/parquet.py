"""Logs as Parquet files (pyarrow): one numeric column a channel, null for a missing measurement."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from svo.checks import optional_import
from svo.logs.columns import Array, wanted_columns
from svo.logs.log import Log
from svo.logs.names import Columns
from svo.store.unpacking import check_unpacked


def write_parquet(path: Path, cells: Mapping[str, Array]) -> None:
    """Write columns (K,) by name; NaN stays NaN."""
    arrow, parquet = _arrow()
    parquet.write_table(arrow.table(dict(cells)), path, write_page_checksum=True)


def read_parquet(path: Path, columns: Columns, Ts: float) -> Log:
    """Read a log; errors name the sample and the column."""
    arrow, parquet = _arrow()
    with path.open("rb") as file:
        with _one_error(path, arrow):
            source = parquet.ParquetFile(file, page_checksum_verification=True)
            schema, rows = source.schema_arrow, source.metadata.num_rows
        names = wanted_columns(str(path), schema.names, columns)
        for name in names:
            kind = schema.field(name).type
            if not (arrow.types.is_integer(kind) or arrow.types.is_floating(kind)):
                raise ValueError(f"{path}, column {name!r} has the type {kind}; expected numbers")
        check_unpacked(path, 8 * max(int(rows), 0) * len(names))
        with _one_error(path, arrow):
            table = source.read(columns=names)
            cells = {name: np.array(table.column(name).to_numpy(), dtype=float) for name in names}
    return Log.from_columns(str(path), cells, columns, Ts)


@contextmanager
def _one_error(path: Path, arrow: Any) -> Iterator[None]:
    try:
        yield
    except (arrow.ArrowException, OSError, MemoryError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is not a Parquet file, or is damaged or cut off ({error})") from error


def _arrow() -> tuple[Any, Any]:
    return optional_import("pyarrow", "study", "Parquet logs"), optional_import(
        "pyarrow.parquet", "study", "Parquet logs"
    )
