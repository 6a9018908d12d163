"""Columns out of MAT files: vectors at places such as ``ScopeData.signals(1).values``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from svo.logs.dialect.hdf5_nodes import hdf5_nodes
from svo.logs.dialect.mat_nodes import mat_nodes
from svo.logs.dialect.mat_places import Node, NoPlaceError, listed_places, numbers_at
from svo.logs.dialect.rules import Which
from svo.logs.mat_elements import Damaged
from svo.logs.mat_file import is_hdf5

_HEAD = 512
_BROKEN = (Damaged, LookupError, RuntimeError, OSError, TypeError, AttributeError, UnicodeError)
"""What reading a damaged file raises; the last ones in h5py."""
_NAME = re.compile(r"[A-Za-z]\w*")


@dataclass(frozen=True)
class MatColumns:
    """The variables of a file.

    Attributes
    ----------
    source : str
        The file, for messages.
    nodes : mapping of str to Node
    """

    source: str
    nodes: Mapping[str, Node]
    again: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def places(self) -> str:
        """Where numbers are, for messages."""
        with suppress(*_BROKEN):
            return listed_places(self.nodes.items())
        return "places that cannot be listed, since the file is damaged"

    def column(self, which: Which) -> NDArray[Any]:
        """The numbers (K,) at a place.

        Raises
        ------
        ValueError
            If there is no vector of real numbers.
        """
        if not isinstance(which, str):
            raise ValueError(f"{self.source}: column {which} is a number; expected a place in a MAT file, as in MATLAB")
        try:
            found = self._numbers(which)
        except NoPlaceError as error:
            raise self._nothing(which, str(error)) from None
        except _BROKEN as error:
            raise ValueError(f"{self.source}, {which}: the file is damaged or cut off: {error}") from error
        if not found.size:
            raise self._nothing(which, "it is empty")
        if found.size != max((1, *found.shape)):
            size = " x ".join(map(str, found.shape))
            raise self._nothing(which, f"it is {size}, no vector; expected one of its columns, {which}(:,1)")
        return found.ravel()

    def _numbers(self, which: str) -> NDArray[Any]:
        name = _NAME.match(which)
        node = self.nodes.get(name[0]) if name else None
        if name is None or node is None:
            raise NoPlaceError("there is no such variable")
        if node.kind == "an object":
            raise _only_matlab(self.source, name[0])
        return numbers_at(node, which[name.end() :])

    def size(self, which: Which) -> int:
        return int(self.column(which).size)

    def label(self, which: Which) -> str:
        return f"variable {which}"

    def place(self, row: int) -> str:
        return f"sample {row}"

    def line(self, row: int) -> int:
        return row

    def _nothing(self, which: str, why: str) -> ValueError:
        return ValueError(f"{self.source}, {which}: {why}. Numbers are at {self.places}")


def read_mat_columns(path: Path) -> MatColumns:
    """The variables of a MAT file of any version.

    Raises
    ------
    ValueError
        If it is damaged or cut off.
    OSError
        If it cannot be opened.
    ImportError
        If it is of version 7.3 and h5py is not installed.
    """
    with path.open("rb") as file:
        head = file.read(_HEAD)
    return MatColumns(str(path), hdf5_nodes(path) if is_hdf5(head) else mat_nodes(path))


def places_in(path: Path) -> str:
    """Where numbers are in a file, for messages."""
    return read_mat_columns(path).places


def _only_matlab(source: str, name: str) -> ValueError:
    return ValueError(
        f"{source}: {name} is an object (a timetable, table, datetime or timeseries?), which only MATLAB can read. Its "
        f"numbers are saved by S = struct('time', seconds({name}.Time - {name}.Time(1)), 'y', {name}.y); "
        "save('log.mat', '-struct', 'S', '-v7'), with names of your own"
    )
