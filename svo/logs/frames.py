"""The columns of a log as data frames of pandas and data sets of xarray."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from svo.checks import Array, optional_import, real_array
from svo.logs.columns import wanted_columns
from svo.logs.names import Columns


def dataframe(cells: Mapping[str, Array], columns: Columns) -> Any:
    """See `Log.to_dataframe`."""
    frame = optional_import("pandas", "study", "data frames").DataFrame(cells)
    frame.attrs["units"] = _units(columns)
    return frame


def cells_of_dataframe(frame: Any, columns: Columns) -> dict[str, Array]:
    """The columns of numbers that a log needs; see `Log.from_dataframe`."""
    optional_import("pandas", "study", "data frames")
    if columns.time not in frame.columns and frame.index.name == columns.time:
        frame = frame.reset_index()
    names = wanted_columns("the data frame", list(frame.columns), columns)
    return {
        name: real_array(f"the data frame, column {name!r}", frame[name], finite=False, missing=True) for name in names
    }


def dataset(cells: Mapping[str, Array], columns: Columns) -> Any:
    """See `Log.to_xarray`."""
    cells, units = dict(cells), _units(columns)
    time = (columns.time, cells.pop(columns.time), {"units": "s"})
    variables = {name: (columns.time, values, {"units": units[name]}) for name, values in cells.items()}
    return optional_import("xarray", "xarray", "data sets").Dataset(variables, coords={columns.time: time})


def cells_of_dataset(dataset: Any, columns: Columns) -> dict[str, Array]:
    """The variables of numbers that a log needs; see `Log.from_xarray`."""
    names = wanted_columns("the data set", list(dataset.variables), columns)
    samples = dataset[columns.time].shape
    cells = {}
    for name in names:
        if len(samples) != 1 or dataset[name].shape != samples:
            raise ValueError(
                f"the data set, variable {name!r} has shape {dataset[name].shape}; expected one dimension, as long as "
                f"{columns.time!r} of shape {samples}"
            )
        values = dataset[name].to_numpy()
        cells[name] = real_array(f"the data set, variable {name!r}", values, finite=False, missing=True)
    return cells


def _units(columns: Columns) -> dict[str, str]:
    return {columns.time: "s"} | {c.name: c.unit for c in (*columns.inputs, *columns.outputs, *columns.states)}
