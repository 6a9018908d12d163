"""Tables of a TOML file, read so that every mistake is one error that names file, table and key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.checks import real_array, real_number

_LONGEST = 200  # characters of a value in an error
_KEY = re.compile(r"^\s*([\w.\"'-]+)\s*=", re.MULTILINE)
_DOTTED = re.compile(r"(?:[\w-]{1,100}\s*\.\s*){50}")
_LONG_NUMBER = re.compile(r"[0-9_]{4300,}")
_KINDS = {str: "text in quotes", bool: "true or false", int: "a whole number", dict: "a table", list: "a list"}


class DescriptionError(ValueError):
    """A mistake whose message names file, table and key."""


@dataclass(frozen=True)
class Table:
    """One table, with its file and its name in it ("" at the top).

    Raises
    ------
    ValueError
        From every method: naming file, table and key, what was found and what was expected.
    """

    path: Path
    name: str
    content: Mapping[str, Any]

    def __contains__(self, key: str) -> bool:
        return key in self.content

    def check_keys(self, known: Sequence[str]) -> None:
        """Refuse keys that nothing would read, with the known one that was probably meant."""
        for key in self.content:
            if key not in known:
                by_lower_case = {name.lower(): name for name in known}
                close = get_close_matches(key.lower(), by_lower_case, n=1)
                meant = f"; did you mean {by_lower_case[close[0]]!r}?" if close else ""
                raise self.error(key, f"there is no such key{meant} (known: {', '.join(known)})")

    def error(self, key: str | None, message: str) -> ValueError:
        """An error that says where it is; without a key, of the table itself."""
        place = [f"{self.path}"]
        if self.name:
            place.append(f"[{self.name}]")
        if key is not None:
            place.append(f"key {shown(key)}")
        return DescriptionError(f"{', '.join(place)}: {message}")

    @contextmanager
    def errors(self, key: str | None = None) -> Iterator[None]:
        """Give errors of what is made from this table, or from one key of it, their place."""
        try:
            yield
        except DescriptionError:
            raise
        except (ValueError, TypeError) as error:
            raise self.error(key, str(error)) from error

    def text(self, key: str, default: str | None = None, choices: Sequence[str] = ()) -> str:
        value = str(self._value(key, str, default))
        if choices and value not in choices:
            raise self.error(key, f"is {shown(value)}; expected one of {', '.join(choices)}")
        return value

    def truth(self, key: str, default: bool) -> bool:
        return bool(self._value(key, bool, default))

    def count(self, key: str, default: int | None = None) -> int:
        return int(self._value(key, int, default))

    def number(self, key: str, default: float | None = None) -> float:
        value = self._value(key, None, default)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(key, f"is {shown(value)}; expected a number")
        with self.errors(key):
            return real_number(key, value, finite=False)

    def file_beside(self, key: str, name: str) -> Path:
        """A file that a key names, relative to the TOML file: beside it, or in a folder beside it."""
        file = Path(name)
        if not name or file.is_absolute() or ".." in file.parts:
            raise self.error(key, f"is {name!r}; expected a file beside the TOML file, or in a folder beside it")
        return file

    def array(self, key: str) -> NDArray[np.float64]:
        """Numbers in brackets, nested for a matrix."""
        value = self._value(key, None, None)
        if not isinstance(value, list) or _has_other_than_numbers(value) or not _has_rows_of_one_length(value):
            wanted = "[1, 2], or [[1, 2], [3, 4]] for a matrix with rows of one length"
            raise self.error(key, f"is {shown(value)}; expected numbers in brackets such as {wanted}")
        with self.errors(key):
            return real_array(key, value, finite=False)

    def table(self, key: str, known: Sequence[str] | None = None) -> Table:
        """A table inside this one; an empty one if it is not there."""
        value = self._value(key, dict, {})
        inner = Table(self.path, self._inside(key), value)
        if known is not None:
            inner.check_keys(known)
        return inner

    def tables(self, key: str, known: Sequence[str]) -> list[Table]:
        """A list of tables inside this one; empty if it is not there."""
        value = self._value(key, list, [])
        if not all(isinstance(item, dict) for item in value):
            raise self.error(key, f"is {shown(value)}; expected a list of tables such as [{{{known[0]} = ...}}]")
        inner = [Table(self.path, f"{self._inside(key)}, entry {i}", item) for i, item in enumerate(value, start=1)]
        for item in inner:
            item.check_keys(known)
        return inner

    def _inside(self, key: str) -> str:
        return f"{self.name}.{key}" if self.name else key

    def _value(self, key: str, kind: type | None, default: Any) -> Any:
        if key not in self.content:
            if default is None:
                close = get_close_matches(key, self.content, n=1, cutoff=0.75)
                raise self.error(key, f"is missing; is it meant by {close[0]!r}?" if close else "is missing")
            return default
        value = self.content[key]
        if kind is not None and (not isinstance(value, kind) or (kind is int and isinstance(value, bool))):
            raise self.error(key, f"is {shown(value)}; expected {_KINDS[kind]}")
        return value


def read_table(path: Path, known: Sequence[str]) -> Table:
    """The top of a TOML file."""
    text = ""
    try:
        text = path.read_text(encoding="utf-8-sig")
        if dotted := _DOTTED.search(text):  # the parser's time grows with the square of the parts
            raise ValueError(f"{_place(text, dotted.start())}: a key has more than 50 parts")
        content = tomllib.loads(text)
    except RecursionError:
        place = _place(text, _deepest(text))
        raise ValueError(f"{path}, {place}: brackets are nested too deeply; expected a matrix in two of them") from None
    except ValueError as error:
        digits = _LONG_NUMBER.search(text)
        if digits and not isinstance(error, tomllib.TOMLDecodeError):
            size, place = len(digits.group()), _place(text, digits.start())
            raise ValueError(f"{path}, {place}: a number has {size} digits; expected one that a float equals") from None
        raise ValueError(f"{path} is not TOML: {error}") from error
    table = Table(path, "", content)
    table.check_keys(known)
    return table


def shown(value: Any) -> str:
    """A value in an error, cut where it is long."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # a number of more digits than Python prints, or lists in lists
        return f"a {type(value).__name__} that is too long to print"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _place(text: str, at: int) -> str:
    """Line and key of a place in a TOML file."""
    keys = _KEY.findall(text, 0, at)
    line = f"line {text.count(chr(10), 0, at) + 1}"
    return f"{line}, key {shown(keys[-1])}" if keys else line


def _deepest(text: str) -> int:
    """The place in a text that is inside of most brackets."""
    depths = np.cumsum([(c in "[{") - (c in "]}") for c in text])
    return int(np.argmax(depths)) if depths.size else 0


def _has_rows_of_one_length(value: list[Any]) -> bool:
    lengths = {len(row) if isinstance(row, list) else None for row in value}
    flat = not any(isinstance(item, list) for row in value if isinstance(row, list) for item in row)
    return flat and len(lengths) <= 1


def _has_other_than_numbers(value: Any) -> bool:
    if isinstance(value, list):
        return any(_has_other_than_numbers(item) for item in value)
    return isinstance(value, bool) or not isinstance(value, int | float)
