"""The one door for numbers that a user gives: taken exactly as they are, or refused with one clear error.

Arrays, lists, tuples, and columns and frames of pandas are taken if they hold floats, integers or truth values.
Refused are what would lose its meaning on the way to a float: masked entries, imaginary parts, text, times, units,
objects, and integers or long floats that no float equals.  An error says which argument it is, what came, what was
expected, and what to do.
"""

import math
import operator
import sys
import warnings
from collections.abc import Iterable, Mapping, Set
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Shape = tuple[int | str, ...]  # a name stands for any size
Item = TypeVar("Item")

_FLOAT = np.dtype(np.float64)
_EXACT = 2**53  # integers up to here are floats
_NUMBERS = "biuf"  # kinds of dtypes: truth values, integers, floats
_PLAIN = (np.matrix, np.memmap)  # subclasses of arrays that mean no more than their numbers
_ADVICE = {
    "c": "Take the real part (.real) if the imaginary part is rounding",
    "m": "Divide by a unit: value / numpy.timedelta64(1, 's')",
    "M": "Subtract a start and divide by a unit, numpy.timedelta64(1, 's')",
    "O": "Convert it to floats: numpy.asarray(value, dtype=float)",
    "S": "Convert text to floats first",
    "U": "Convert text to floats first",
    "V": "Take one field at a time",
}


def real_array(
    name: str, value: Any, *shapes: Shape, meaning: str = "", finite: bool = True, missing: bool = False
) -> Floats:
    """`value` as a new float64 array, every number exactly as it was.

    Parameters
    ----------
    name : str
        What the caller calls the argument.
    value : array_like
    *shapes : tuples of int or str
        The shapes that are taken, any if none is given; a name stands for any size: ``("k", 3)``.
    meaning : str
        What the shape stands for, said in the error: "one entry per row of A".
    finite : bool
        Whether infinities are refused.
    missing : bool
        Whether entries may be missing: NaN, masked, None or ``pandas.NA``, all of which become NaN.

    Raises
    ------
    TypeError
        If it is not made of real numbers.
    ValueError
        If it has another shape, a missing entry, an infinity, or a number that no float equals.
    """
    array = value.copy() if _is_float_array(value) else _converted(name, value, missing)
    if shapes and not _fit(array.shape, shapes):
        raise ValueError(_misfit(name, array.shape, shapes, meaning))
    if math.isfinite(np.vdot(array, array)) or np.isfinite(array).all():  # squares may leave the floats
        return array
    if not missing and np.isnan(array).any():
        raise ValueError(f"{name} contains NaN{_place(np.isnan(array))}; expected numbers. Remove or replace it.")
    if finite and np.isinf(array).any():
        place = _place(np.isinf(array))
        raise ValueError(
            f"{name} contains an infinity{place}; expected finite numbers. Leave out what is not to be bounded."
        )
    return array


def real_number(name: str, value: Any, *, least: float = -math.inf, finite: bool = True) -> float:
    """`value` as one float, at least `least`; errors as of `real_array`."""
    number = float(value) if type(value) is float else float(real_array(name, value, (), finite=False))
    if math.isnan(number) or (finite and math.isinf(number)):
        raise ValueError(f"{name} is {number}; expected a finite number.")
    if number < least:
        raise ValueError(f"{name} is {number}; expected at least {least:g}.")
    return number


def whole_number(name: str, value: Any, *, least: int | None = None) -> int:
    """`value` as one integer, at least `least`; TypeError for anything but an integer, floats and truth values too."""
    number = value if type(value) is int else _index(name, value)
    if least is not None and number < least:
        raise ValueError(f"{name} is {number}; expected an integer of at least {least}.")
    return number


def _index(name: str, value: Any) -> int:
    try:
        if isinstance(value, bool | np.bool_):
            raise TypeError
        return operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is {value!r}, {_kind_of(value)}; expected an integer.") from None


def different_coordinates(name: str, value: Any, dim: int) -> list[int]:
    """One or more different integers from 0 up to dim - 1, in their order."""
    try:
        if isinstance(value, str | bytes | Mapping | Set):
            raise TypeError
        found = [whole_number(name, j) for j in value]
    except TypeError:
        raise TypeError(f"{name} is {value!r}; expected a sequence of integers below {dim}.") from None
    if not found or len(set(found)) != len(found) or min(found) < 0 or max(found) >= dim:
        raise ValueError(f"{name} is {found}; expected different coordinates below {dim}, at least one.")
    return found


def listed(name: str, value: Any, kind: type[Item], *others: type[Item], called: str = "") -> list[Item]:
    """What a sequence holds, each item of one of some kinds; TypeError otherwise.

    A mapping is none: its keys are not meant.  `called` is what users call the kinds.
    """
    expected = f"expected a sequence of {called or ' or '.join(k.__name__ for k in (kind, *others))}"
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        raise TypeError(f"{name} is {_kind_of(value)}; {expected}.")
    items = list(value)
    for i, item in enumerate(items):
        if not isinstance(item, (kind, *others)):
            raise TypeError(f"{name}[{i}] is {_kind_of(item)}; {expected}.")
    return items


def _is_float_array(value: Any) -> bool:
    return type(value) is np.ndarray and value.dtype == _FLOAT


def _masked() -> tuple[type, ...]:
    """The classes of masked arrays: none while nobody has loaded their module, which takes time."""
    return (np.ma.MaskedArray, type(np.ma.masked)) if "numpy.ma" in sys.modules else ()


def _converted(name: str, value: Any, missing: bool) -> Floats:
    """The numbers of anything but a plain array of floats."""
    if type(value) is int:
        return np.array(_float_of(name, value))
    if hasattr(value, "iloc") and hasattr(value, "columns"):  # a frame: its columns may be of different types
        columns = [
            real_array(f"{name}[{label!r}]", value.iloc[:, j], finite=False, missing=missing)
            for j, label in enumerate(value.columns)
        ]
        return np.stack(columns, axis=1) if columns else np.empty(value.shape)
    _refuse_what_loses_its_meaning(name, value)
    if isinstance(value, _masked()):
        return _filled(name, value, missing)
    raw = _as_numpy(name, value)
    listed = isinstance(value, list | tuple)
    nullable = getattr(getattr(value, "dtype", None), "kind", "O") in _NUMBERS  # integers of pandas with gaps
    if raw.dtype.kind == "O" and (listed or nullable):
        return np.array(_leaves(name, raw.ravel().tolist(), missing), dtype=np.float64).reshape(raw.shape)
    _check_kind(name, raw, value)
    if not listed:
        return _exactly(name, raw)
    leaves = np.array(_leaves(name, value, missing), dtype=np.float64)
    return leaves.reshape(raw.shape)


def _refuse_what_loses_its_meaning(name: str, value: Any) -> None:
    what = f"{name} is {_kind_of(value)}"
    if hasattr(value, "toarray"):
        raise TypeError(f"{what}; expected a dense array. Use {name}.toarray().")
    numeric = getattr(getattr(value, "dtype", None), "kind", "f") in _NUMBERS
    if numeric and (hasattr(value, "units") or hasattr(value, "unit")):
        raise TypeError(f"{what} with a unit; expected plain numbers. Convert it, and take its numbers.")
    if isinstance(value, np.ndarray) and type(value) not in (np.ndarray, *_PLAIN, *_masked()):
        raise TypeError(f"{what}; expected a plain array. Use numpy.asarray if only its numbers count.")


def _as_numpy(name: str, value: Any) -> NDArray[Any]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # masked entries in lists: looked for one by one below
            return np.asarray(value)
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        raise ValueError(f"{name} is no array: {error}. Expected numbers in rows of one length.") from None


def _check_kind(name: str, raw: NDArray[Any], value: Any) -> None:
    kind = raw.dtype.kind
    if kind not in _NUMBERS:
        what = f"is {_kind_of(value)}" if kind == "O" and raw.ndim == 0 else f"has dtype {raw.dtype}"
        raise TypeError(f"{name} {what}; expected real numbers. {_ADVICE.get(kind, 'Convert it to floats first')}.")


@lru_cache(4096)
def _fit(shape: tuple[int, ...], shapes: tuple[Shape, ...]) -> bool:
    alike = [zip(shape, wanted, strict=True) for wanted in shapes if len(shape) == len(wanted)]
    return any(all(size == want or isinstance(want, str) for size, want in pairs) for pairs in alike)


def _misfit(name: str, shape: tuple[int, ...], shapes: tuple[Shape, ...], meaning: str) -> str:
    wanted = " or ".join(_shape_text(shape) for shape in shapes)
    return f"{name} has shape {shape}; expected {wanted}{', ' if meaning else ''}{meaning}."


def _shape_text(shape: Shape) -> str:
    inside = ", ".join(str(size) for size in shape)
    return f"({inside},)" if len(shape) == 1 else f"({inside})" if shape else "() (one number)"


def _filled(name: str, value: Any, missing: bool) -> Floats:
    """The numbers of a masked array, NaN where it is masked."""
    mask = np.ma.getmaskarray(value)
    if mask.any() and not missing:
        raise ValueError(
            f"{name} has {np.count_nonzero(mask)} masked entries{_place(mask)}; expected numbers. Fill or remove them."
        )
    raw = np.where(mask, np.zeros((), value.dtype), value.data) if mask.any() else value.data
    _check_kind(name, raw, value)
    return np.asarray(np.where(mask, np.nan, _exactly(name, raw)), dtype=np.float64)


def _exactly(name: str, raw: NDArray[Any]) -> Floats:
    """An array of real numbers as floats; ValueError for one that no float equals."""
    with np.errstate(over="ignore"):
        array = np.array(raw, dtype=np.float64, order="C")
    if raw.dtype.kind in "iu" and raw.dtype.itemsize == 8:
        large = (array >= _EXACT) | (array <= -_EXACT)
        wrong = np.zeros(raw.shape, dtype=bool)
        wrong[large] = [int(u) != v for u, v in zip(array[large].tolist(), raw[large].tolist(), strict=True)]
    elif raw.dtype.kind == "f" and raw.dtype.itemsize > 8:
        wrong = (array != raw) & ~np.isnan(raw)
    else:
        return array
    if wrong.any():
        raise _no_float(name, raw[wrong][0])
    return array


def _leaves(name: str, values: Iterable[Any], missing: bool) -> list[float]:
    """The numbers in nested lists, one after the other."""
    found: list[float] = []
    for v in values:
        if type(v) is float or type(v) is np.float64:
            found.append(v)
        elif type(v) is int:
            found.append(_float_of(name, v))
        elif isinstance(v, list | tuple):
            found += _leaves(name, v, missing)
        elif v is None or type(v).__name__ in ("NAType", "MaskedConstant"):
            if not missing:
                raise ValueError(f"{name} has a missing entry ({v!r}); expected numbers. Remove or replace it.")
            found.append(math.nan)
        else:
            found += real_array(name, _number_like(name, v), finite=False, missing=True).ravel().tolist()
    return found


def _number_like(name: str, leaf: Any) -> Any:
    """An entry of a list that may be taken for a number or numbers: one of Python or NumPy, or an array."""
    if isinstance(leaf, np.generic | np.ndarray) or hasattr(leaf, "iloc"):
        return leaf
    if isinstance(leaf, int | float):  # a truth value, or a subclass
        return float(leaf)
    raise TypeError(f"{name} holds {_kind_of(leaf)}; expected real numbers. Convert it to floats.")


def _float_of(name: str, value: int) -> float:
    try:
        number = float(value)
    except OverflowError:
        raise _no_float(name, value) from None
    if abs(value) > _EXACT and int(number) != value:
        raise _no_float(name, value)
    return number


def _no_float(name: str, value: Any) -> ValueError:
    long = isinstance(value, int) and abs(value) > 2**200
    text = f"an integer of {value.bit_length()} bits" if long else str(value)
    return ValueError(f"{name} contains {text}, which no float equals. Round it first: float(value).")


def _place(wrong: NDArray[np.bool_]) -> str:
    """Where the first of them is."""
    return f" at {[int(i) for i in np.argwhere(wrong)[0]]}" if wrong.ndim else ""


def _kind_of(value: Any) -> str:
    kind = type(value)
    return f"a {kind.__qualname__}" if kind.__module__ == "builtins" else f"a {kind.__module__}.{kind.__qualname__}"
