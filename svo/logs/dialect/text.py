"""Bytes to lines: encodings, byte order marks, ends of lines."""

from __future__ import annotations

import codecs
from pathlib import Path

# The longer ones first: that of UTF-32 begins with that of UTF-16.
_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


# What logs are also kept in, that somebody takes for text.
_BINARY = (
    (b"PK\x03\x04", "a zip archive, as .xlsx and .ods files are; save the sheet as CSV, or unpack the archive"),
    (b"\xd0\xcf\x11\xe0", "an old .xls spreadsheet; save the sheet as CSV"),
    (b"\x1f\x8b", "compressed by gzip; unpack it first"),
    (b"PAR1", "a Parquet file; give it a name that ends in .parquet"),
    (b"MATLAB 5.0", "a MAT file; give it a name that ends in .mat"),
    (b"MATLAB 7.3", "a MAT file; give it a name that ends in .mat"),
    (b"\x89HDF", "HDF5; export its channels as text or as a MAT file"),
    (b"MDF     ", "an MDF recording; export its channels as text or as a MAT file"),
    (b"TDSm", "a TDMS file of LabVIEW; export its channels as text"),
    (b"SQLite format 3", "an SQLite database; export its table as CSV"),
)


def wide_encoding(data: bytes) -> str:
    """Which encoding of two bytes a letter a text without a byte order mark is in, by where its zeros are."""
    return "utf-16-le" if data[1:200:2].count(0) >= data[:200:2].count(0) else "utf-16-be"


def mark_of(data: bytes) -> tuple[bytes, str] | None:
    """The byte order mark at the beginning of a file, and the encoding that it stands for."""
    return next(((mark, name) for mark, name in _MARKS if data.startswith(mark)), None)


def check_text(path: Path, data: bytes) -> None:
    """Raise a ValueError if a file begins as one of another kind does."""
    binary = next((what for magic, what in _BINARY if data.startswith(magic)), None)
    if binary is not None:
        raise ValueError(f"{path} is no text but {binary}")


def lines_of(path: Path, encoding: str) -> tuple[list[str], bool]:
    """The lines of a text file without their ends, and whether the last one has an end.

    Raises
    ------
    ValueError
        If the bytes are no text of that encoding.
    OSError
        If the file cannot be opened.
    """
    data = path.read_bytes()
    mark = mark_of(data)
    if mark is not None:
        data, encoding = data[len(mark[0]) :], mark[1]
    check_text(path, data)
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        raise _no_text(path, data, error, encoding) from error
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise ValueError(
            f"{path}, line {line}: a NUL character, which is no text; a file of two bytes a letter without a byte "
            f'order mark needs encoding = "{wide_encoding(data)}" in [log], and one of binary numbers is no text at all'
        )
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    whole = not lines[-1].strip()
    return (lines[:-1] if not lines[-1] else lines), whole


def _no_text(path: Path, data: bytes, error: UnicodeDecodeError, encoding: str) -> ValueError:
    line = data.count(b"\n", 0, error.start) + 1
    byte = f"0x{data[error.start]:02x}" if error.start < len(data) else "the end"
    other = ', such as encoding = "cp1252"' if encoding.lower().replace("_", "-") in ("utf-8", "utf8", "ascii") else ""
    return ValueError(f"{path}, line {line}: byte {byte} is not {encoding}; state the encoding in [log]{other}")
