"""Logs to and from data frames of pandas and data sets of xarray, by the columns of a plant."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from svo.checks import optional_import, real_array
from svo.logs.columns import columns_of_log, log_of_columns, wanted_columns
from svo.logs.log import Log

if TYPE_CHECKING:
    from svo.logs.names import Column, Columns


def to_dataframe(log: Log, columns: Columns) -> Any:
    """A `pandas.DataFrame`, one column a channel (time included), in the order of a log file.

    The units are in ``frame.attrs["units"]``, by column name.
    """
    frame = optional_import("pandas", "study", "data frames").DataFrame(columns_of_log(log, columns))
    frame.attrs["units"] = _units(columns)
    return frame


def from_dataframe(frame: Any, columns: Columns, Ts: float) -> Log:
    """A log from a `pandas.DataFrame`, under the rules of `svo.logs.columns`.

    Parameters
    ----------
    frame : pandas.DataFrame
        Time is a column, or the index if that has the name of the time column.
    columns : Columns
    Ts : float
        The model's sampling time [s].

    Raises
    ------
    TypeError, ValueError
        Naming the sample and the column.
    """
    optional_import("pandas", "study", "data frames")
    if columns.time not in frame.columns and frame.index.name == columns.time:
        frame = frame.reset_index()
    names = wanted_columns("the data frame", list(frame.columns), columns)
    cells = {}
    for name in names:
        cells[name] = real_array(f"the data frame, column {name!r}", frame[name], finite=False, missing=True)
    return log_of_columns("the data frame", cells, columns, Ts)


def to_xarray(log: Log, columns: Columns) -> Any:
    """An `xarray.Dataset` over the time of the log: one variable a channel, with its unit as the attribute "units"."""
    cells, units = columns_of_log(log, columns), _units(columns)
    time = (columns.time, cells.pop(columns.time), {"units": "s"})
    variables = {name: (columns.time, values, {"units": units[name]}) for name, values in cells.items()}
    return optional_import("xarray", "xarray", "data sets").Dataset(variables, coords={columns.time: time})


def from_xarray(dataset: Any, columns: Columns, Ts: float) -> Log:
    """A log from an `xarray.Dataset` whose variables are the columns, each over one dimension.

    Raises
    ------
    TypeError, ValueError
        Naming the sample and the variable.
    """
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
    return log_of_columns("the data set", cells, columns, Ts)


def _units(columns: Columns) -> dict[str, str]:
    every: tuple[Column, ...] = columns.inputs + columns.outputs + columns.states
    return {columns.time: "s"} | {c.name: c.unit for c in every}
