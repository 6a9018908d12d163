"""Logs as MAT files up to version 7.2: one vector a channel, all of one length.

Other variables, such as the scalars of a test's settings, are ignored.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from svo.logs.columns import Array, Note, check_cells, noted, wanted_columns
from svo.logs.dialect.mat import places_in
from svo.logs.mat_file import MatFile
from svo.logs.names import Columns
from svo.logs.portions import Rows, samples_from

_VARIABLE = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,30}")


def write_mat(path: Path, cells: Mapping[str, Array]) -> None:
    """Write columns (K,) as column vectors.

    Raises
    ------
    ValueError
        If a column's name is not one that a MAT file can hold.
    """
    from scipy.io import savemat

    for name in cells:
        if not _VARIABLE.fullmatch(name):
            raise ValueError(
                f"column {name!r} cannot be a variable of a MAT file; expected a letter, then at most 30 letters, "
                "digits and underscores"
            )
    savemat(path, {name: values[:, None] for name, values in cells.items()}, appendmat=False)


def _elsewhere(path: Path, file: MatFile) -> str:
    """What a message says of numbers that stand inside structures."""
    if "a struct" not in file.kinds.values():
        return ""
    return f". Numbers are at {places_in(path)}: state these places as column in [log.columns] and [log.time]"


def read_mat_log(path: Path, columns: Columns, note: Note = noted) -> Iterator[Rows]:
    """The rows of a log, all at once; errors name the sample and the variable."""
    file = MatFile.open(path)
    needed = (columns.time, *(c.name for c in columns.inputs + columns.outputs))
    for name, kind in file.kinds.items():
        if name in needed and kind != "numbers":
            raise ValueError(
                f"{path} has no column {name!r} of numbers; the variable of that name is {kind}{_elsewhere(path, file)}"
            )
    if set(needed) - set(file.numeric) and (elsewhere := _elsewhere(path, file)):
        lost = ", ".join(repr(name) for name in needed if name not in file.numeric)
        raise ValueError(f"{path} has no variable {lost}{elsewhere}")
    names = wanted_columns(str(path), file.numeric, columns)
    variables = file.read(names)
    samples = variables[columns.time].size
    for name in names:
        shape = variables[name].shape
        if variables[name].size != samples or samples not in shape:
            raise ValueError(
                f"{path}, variable {name!r} has shape {shape}; expected a vector of {samples} samples, as "
                f"{columns.time!r} has"
            )
    cells, place = {name: variables[name].ravel() for name in names}, samples_from(0)
    check_cells(str(path), cells, columns, place)
    yield Rows(cells, place)
