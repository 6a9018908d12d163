"""Logs as Parquet files (pyarrow): one numeric column a channel, null for a missing measurement."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from svo.log import Log
from svo.log_columns import Array, log_of_columns, wanted_columns
from svo.optional import optional_import

if TYPE_CHECKING:
    from svo.plant import Columns


def write_parquet(path: Path, cells: Mapping[str, Array]) -> None:
    """Write columns (K,) by name; NaN stays NaN."""
    arrow, parquet = _arrow()
    parquet.write_table(arrow.table(dict(cells)), path)


def read_parquet(path: Path, columns: Columns, Ts: float) -> Log:
    """Read a log; errors name the sample and the column."""
    arrow, parquet = _arrow()
    try:
        with path.open("rb") as file:
            names = wanted_columns(str(path), parquet.ParquetFile(file).schema_arrow.names, columns)
            table = parquet.read_table(file, columns=names)
    except arrow.ArrowInvalid as error:
        raise ValueError(f"{path} is not a Parquet file ({error})") from error
    cells = {}
    for name in names:
        kind = table.schema.field(name).type
        if not (arrow.types.is_integer(kind) or arrow.types.is_floating(kind)):
            raise ValueError(f"{path}, column {name!r} has the type {kind}; expected numbers")
        cells[name] = np.array(table.column(name).to_numpy(), dtype=float)
    return log_of_columns(str(path), cells, columns, Ts)


def _arrow() -> tuple[Any, Any]:
    return optional_import("pyarrow", "study", "Parquet logs"), optional_import(
        "pyarrow.parquet", "study", "Parquet logs"
    )
