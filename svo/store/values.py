"""Arrays, sets and certificates as JSON, and back: floats in hexadecimal, read in the one form that is written.

A record is somebody's file: what is read has the exact type and shape that `encode_value` writes, or is a ValueError.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import cache
from types import NoneType, UnionType
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from polytopes import Certificate, HPolytope
from svo.checks import Array

LARGEST_INTEGER = 2**53
_ZERO = (0.0).hex()  # is written as 0
_WORD = r"(?:-?0x[01](?:\.[0-9a-f]{1,13})?p[+-][0-9]{1,4}|0|nan|-?inf)"  # none is the beginning of a later one
_FLOAT, _FLOATS = re.compile(_WORD), re.compile(rf"(?:{_WORD}(?: {_WORD})*+)?")


def parse_once(text: str) -> Any:
    """JSON that no two programs read differently: ASCII, no entry twice in an object, no NaN or Infinity.

    Raises
    ------
    ValueError
        If it is none.
    RecursionError
        If it is nested too deeply.
    """
    if not text.isascii():
        raise ValueError("it has other characters than ASCII")
    return json.loads(text, object_pairs_hook=_once, parse_constant=decode_float)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) != len(pairs):
        raise ValueError("an entry stands twice in an object")
    return table


def encode_value(value: Any) -> Any:
    """Arrays, tuples and dataclasses of them as lists, dicts and text."""
    if isinstance(value, np.ndarray):
        if np.issubdtype(value.dtype, np.integer):
            return value.tolist()
        words = map(float.hex, np.asarray(value, dtype=np.float64).ravel().tolist())
        return {"shape": list(value.shape), "hex": " ".join("0" if word == _ZERO else word for word in words)}
    if isinstance(value, tuple):
        return [encode_value(item) for item in value]
    if isinstance(value, HPolytope):
        return {part: encode_value(getattr(value, part)) for part in "AbCd"}
    if isinstance(value, Certificate):
        return value.to_dict()
    if hasattr(type(value), "__dataclass_fields__"):
        entries = {f.name: encode_value(getattr(value, f.name)) for f in fields(value)}
        return {name: entry for name, entry in entries.items() if entry is not None}
    return value


def decode_float(text: Any) -> float:
    """A float that was written in hexadecimal, and in no other way: float.fromhex alone reads 50 as 80."""
    if not isinstance(text, str) or not _FLOAT.fullmatch(text):
        raise ValueError(f"expected a float as float.hex writes it, found {_short(text)}")
    return float.fromhex(text)


def decode_integer(value: Any) -> int:
    """An integer that is written as one, of at most 2^53 in size."""
    if type(value) is not int or abs(value) > LARGEST_INTEGER:
        raise ValueError(f"expected an integer of at most 2^53 in size, found {_short(value)}")
    return value


def decode_array(value: Any) -> Array:
    """A float array that `encode_value` wrote."""
    check_keys(value, {"shape", "hex"})
    shape = tuple(decode_integer(length) for length in decode_list(value["shape"]))
    text = value["hex"]
    words = text.split(" ") if text else []
    decode = float.fromhex if _FLOATS.fullmatch(text) else decode_float  # which names the first word that is none
    return np.array(list(map(decode, words)), dtype=np.float64).reshape(shape)


def decode_integers(value: Any) -> NDArray[np.int64]:
    """An array (k,) of integers that `encode_value` wrote."""
    return np.array([decode_integer(item) for item in decode_list(value)], dtype=np.int64)


def decode_arrays(record: Any, names: set[str]) -> dict[str, Array]:
    """A record of exactly these float arrays."""
    check_keys(record, names)
    return {key: decode_array(value) for key, value in record.items()}


def decode_set(record: Any) -> HPolytope:
    """A polytope that `encode_value` wrote."""
    arrays = decode_arrays(record, set("AbCd"))
    return HPolytope(*(arrays[part] for part in "AbCd"))


def decode_value(kind: Any, record: Any) -> Any:
    """What `encode_value` wrote of a value of this type.

    Parameters
    ----------
    kind : type
        `Array`, an array of integers, int, bool, `HPolytope`, `Certificate`, a dataclass whose fields are of these, or
        a tuple of them; fields that may be None are then missing.
    """
    if isinstance(kind, UnionType):
        (kind,) = (item for item in get_args(kind) if item is not NoneType)
    decode = _DECODERS.get(kind)
    if decode is not None:
        return decode(record)
    if get_origin(kind) is tuple:
        return tuple(decode_value(get_args(kind)[0], item) for item in decode_list(record))
    return kind(**decode_fields(kind, record))


def decode_fields(
    kind: Any, record: Any, others: set[str] | frozenset[str] = frozenset(), *, absent: set[str] | None = None
) -> dict[str, Any]:
    """The fields of a dataclass of this type but for ``others``, which the record has in another form.

    Those that are ``absent`` stand elsewhere.
    """
    kinds, optional = _fields(kind)
    names = kinds.keys() - (absent or set())
    check_keys(record, names - (optional - record.keys() if isinstance(record, Mapping) else set()))
    return {name: decode_value(kinds[name], value) for name, value in record.items() if name not in others}


def _decode_truth(value: Any) -> bool:
    if type(value) is not bool:
        raise TypeError(f"expected true or false, found {_short(value)}")
    return value


_DECODERS: dict[Any, Callable[[Any], Any]] = {
    Array: decode_array,
    NDArray[np.int64]: decode_integers,
    int: decode_integer,
    bool: _decode_truth,
    HPolytope: decode_set,
    Certificate: Certificate.from_dict,
}


@cache
def _fields(kind: type) -> tuple[dict[str, Any], set[str]]:
    """Types of a dataclass' fields by name, and the names of those that may be missing."""
    hints, entries = get_type_hints(kind), fields(kind)
    return {f.name: hints[f.name] for f in entries}, {f.name for f in entries if f.default is None}


def check_keys(record: Any, names: set[str]) -> None:
    """Raise an error unless a record has exactly these entries."""
    if not isinstance(record, Mapping):
        raise TypeError(f"expected a table of {', '.join(sorted(names))}, found {_short(record)}")
    if record.keys() != names:
        wrong = sorted(str(key) for key in record.keys() ^ names)
        raise ValueError(f"entries {_short(', '.join(wrong))} are missing or not of the format")


def decode_list(value: Any) -> list[Any]:
    """A list, or a TypeError."""
    if not isinstance(value, list):
        raise TypeError(f"expected a list, found {_short(value)}")
    return value


def _short(value: Any) -> str:
    """A value as a message may show it: a sample of 4000 digits would flood the terminal."""
    if isinstance(value, int) and abs(value) > LARGEST_INTEGER:
        return "a larger one"
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:40]}..."
