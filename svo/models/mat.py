"""Arrays of a model from a MAT file."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.logs.mat_file import MatFile

_MATRICES = ("A", "B", "E", "C", "D", "F")
_VECTORS = ("a", "c", "n", "w")


def read_arrays(path: str | Path) -> dict[str, Any]:
    """The variables of a MAT file that are arguments of `svo.UncertainModel`.

    A, B, C, D, E and F are matrices; a, c, n and w vectors, as a row or a column; w_lower and w_upper together
    are the argument w. Other variables are ignored.

    Raises
    ------
    ValueError
        If the file is no MAT file of version 7.2 or older, has none of these variables, or one of the wrong shape.
    """
    file, wanted = MatFile.open(path), (*_MATRICES, *_VECTORS, "w_lower", "w_upper")
    for name in wanted:
        if file.kinds.get(name, "numbers") != "numbers":
            raise ValueError(f"{path}: variable {name!r} is {file.kinds[name]}; expected real numbers, or another name")
    variables = file.read(file.numeric)
    arrays: dict[str, Any] = {name: variables[name] for name in _MATRICES if name in variables}
    for name in (*_VECTORS, "w_lower", "w_upper"):
        if name in variables:
            arrays[name] = _vector(path, name, variables[name])
    ends = [arrays.pop(name, None) for name in ("w_lower", "w_upper")]
    if any(end is not None for end in ends):
        if "w" in arrays or any(end is None for end in ends):
            raise ValueError(f"{path} has some of w, w_lower and w_upper; expected w, or w_lower with w_upper")
        arrays["w"] = tuple(ends)
    if not arrays:
        raise ValueError(
            f"{path} has none of the variables {', '.join((*_MATRICES, *_VECTORS))}; found {', '.join(variables)}"
        )
    return arrays


def read_model(path: str | Path, given: Collection[str]) -> dict[str, Any]:
    """`read_arrays`, with what makes them the arguments of a whole model beside those that are ``given``."""
    arrays = read_arrays(path)
    for name in arrays.keys() & set(given):
        raise ValueError(f"{name} is given and {path} has it too; leave it out")
    for name in {"A", "C"} - {*arrays, *given}:
        raise ValueError(f"{path} has no variable {name!r}; expected a matrix, or give it as an argument")
    return arrays


def _vector(path: str | Path, name: str, value: NDArray[np.float64]) -> NDArray[np.float64]:
    if value.size != max(value.shape):
        raise ValueError(f"{path}: variable {name!r} has shape {value.shape}; expected a vector")
    return value.ravel()
