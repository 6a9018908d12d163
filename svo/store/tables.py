"""Rows of a dataclass as a sealed file: Parquet for tables that people read, JSON where nothing else is needed."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Protocol, get_args, get_origin, get_type_hints

from svo.store.seal import Seal, sealed

_ALIASES = {int: "int64", float: "float64", str: "string", bool: "bool"}


class Format(Protocol):
    """How the rows of a part become bytes, and come back from intact files."""

    suffix: str

    def encode(self, rows: Sequence[Any], row: type[Any], seal: Seal, metadata: Mapping[str, str]) -> bytes:
        """A sealed file of rows of one class."""
        ...

    def decode(self, paths: Sequence[Path], row: type[Any]) -> list[Any]:
        """The rows of all files, file by file."""
        ...


class Parquet:
    """One column a field; the pages have checksums too, for readers that look at these."""

    suffix = ".parquet"

    def encode(self, rows: Sequence[Any], row: type[Any], seal: Seal, metadata: Mapping[str, str]) -> bytes:
        import pyarrow as pa
        import pyarrow.parquet as pq

        schema = pa.schema(_columns(row), metadata={**metadata, "svo.part": seal.blank()})
        table = pa.Table.from_pylist([asdict(r) for r in rows], schema=schema)
        file = io.BytesIO()
        pq.write_table(table, file, write_page_checksum=True)
        return sealed(file.getvalue())

    def decode(self, paths: Sequence[Path], row: type[Any]) -> list[Any]:
        import pyarrow.parquet as pq

        table = pq.read_table([str(path) for path in paths], columns=[f.name for f in fields(row)])
        return [_row(row, r) for r in table.to_pylist()]


class Json:
    """One line for the seal and one for each row."""

    suffix = ".jsonl"

    def encode(self, rows: Sequence[Any], row: type[Any], seal: Seal, metadata: Mapping[str, str]) -> bytes:
        lines = [seal.blank(), *(json.dumps(asdict(r), default=_plain) for r in rows)]
        return sealed("".join(line + "\n" for line in lines).encode())

    def decode(self, paths: Sequence[Path], row: type[Any]) -> list[Any]:
        lines = [line for path in paths for line in path.read_text(encoding="utf-8").splitlines()[1:]]
        return [_row(row, json.loads(line)) for line in lines]


def _plain(value: Any) -> Any:
    """A number of numpy as one of Python."""
    return value.item()


def _row(row: type[Any], values: Mapping[str, Any]) -> Any:
    return row(**{name: tuple(value) if isinstance(value, list) else value for name, value in values.items()})


def _columns(row: type[Any]) -> list[Any]:
    """(name, Arrow type) of each field of a dataclass of numbers, text, and tuples of one of these."""
    import pyarrow as pa

    def arrow(hint: Any) -> Any:
        if get_origin(hint) is UnionType:
            (hint,) = (kind for kind in get_args(hint) if kind is not NoneType)
        if get_origin(hint) is tuple:
            return pa.list_(arrow(get_args(hint)[0]))
        return pa.type_for_alias(_ALIASES[hint])

    hints = get_type_hints(row)
    return [(f.name, arrow(hints[f.name])) for f in fields(row)]
