"""Logs as Parquet files (pyarrow): one numeric column a channel, null for a missing measurement."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from svo.checks import optional_import
from svo.logs.arrow import numbers_of
from svo.logs.columns import Array, Note, check_cells, noted, wanted_columns
from svo.logs.names import Columns
from svo.logs.portions import Rows, samples_from
from svo.store.unpacking import check_unpacked

ROWS = 1 << 15


def write_parquet(path: Path, cells: Mapping[str, Array], told: Mapping[str, str] | None = None) -> None:
    """Write columns (K,) by name, and beside them what is ``told`` of them by key; NaN stays NaN."""
    arrow, parquet = _arrow()
    table = arrow.table(dict(cells)).replace_schema_metadata(dict(told or {}))
    parquet.write_table(table, path, write_page_checksum=True, row_group_size=4 * ROWS)


def told_in(path: Path, key: str) -> str | None:
    """What is told of a file's columns by that key; None if nothing is."""
    arrow, parquet = _arrow()
    with path.open("rb") as file, _one_error(path, arrow):
        found = parquet.ParquetFile(file).schema_arrow.metadata or {}
        text = found.get(key.encode())
        return None if text is None else text.decode()


def read_table(path: Path) -> Any:
    """A file as a table of pyarrow, whatever its columns are."""
    arrow, parquet = _arrow()
    with path.open("rb") as file, _one_error(path, arrow):
        source = parquet.ParquetFile(file, page_checksum_verification=True)
        groups = range(source.metadata.num_row_groups)
        check_unpacked(path, sum(source.metadata.row_group(i).total_byte_size for i in groups))
        return source.read()


def read_parquet(path: Path, columns: Columns, note: Note = noted, *, rows: int = ROWS) -> Iterator[Rows]:
    """The rows of a log, so many at a time; errors name the sample and the column."""
    arrow, parquet = _arrow()
    with path.open("rb") as file:
        with _one_error(path, arrow):
            source = parquet.ParquetFile(file, page_checksum_verification=True)
            schema, samples = source.schema_arrow, int(source.metadata.num_rows)
        names = wanted_columns(str(path), schema.names, columns)
        for name in names:
            kind = schema.field(name).type
            if not (arrow.types.is_integer(kind) or arrow.types.is_floating(kind)):
                raise ValueError(f"{path}, column {name!r} has the type {kind}; expected numbers")
        check_unpacked(path, 8 * max(samples, 0) * len(names))
        first = 0
        for cells in _batches(path, arrow, source.iter_batches(rows, columns=names), names):
            place = samples_from(first)
            check_cells(str(path), cells, columns, place)
            yield Rows(cells, place)
            first += len(cells[columns.time])


def _batches(path: Path, arrow: Any, batches: Iterator[Any], names: Sequence[str]) -> Iterator[dict[str, Array]]:
    """The numbers of each batch by column, with one kind of error for what is damaged."""
    while True:
        with _one_error(path, arrow):
            batch = next(batches, None)
            if batch is None:
                return
            cells = {name: numbers_of(batch.column(name)) for name in names}
        yield cells


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
