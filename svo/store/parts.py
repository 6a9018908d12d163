"""The parts of a table, one file a run: written whole, sealed, and joined once each."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic, TypeVar

from svo.store.seal import Seal, read_seal
from svo.store.tables import Format, Parquet
from svo.store.whole import write_whole

Row = TypeVar("Row")
_NAME = re.compile(r"run-(\d{6,})")


@dataclass(frozen=True)
class Survey:
    """What stands in a folder of parts.

    Attributes
    ----------
    intact : mapping of int to Seal
        By run.
    damaged : mapping of int to str
        Parts of runs that cannot be used, and why.
    strays : mapping of Path to str
        Files that are no parts of this study, and why; they are left alone. Hidden files are not named.
    """

    intact: Mapping[int, Seal]
    damaged: Mapping[int, str]
    strays: Mapping[Path, str]


@dataclass(frozen=True)
class Parts(Generic[Row]):
    """A folder with one file of rows for each run.

    Parameters
    ----------
    folder : Path
    row : type
        The dataclass of a row; numbers, text, and None.
    study : str
        What the parts belong to (a digest); a part of something else is a stray.
    format : Format
    runs : int, optional
        How many runs there are; parts of others are strays.
    """

    folder: Path
    row: type[Row]
    study: str
    format: Format = field(default_factory=Parquet)
    runs: int | None = None

    def path(self, run: int) -> Path:
        return self.folder / f"{part_name(run)}{self.format.suffix}"

    def write(
        self,
        run: int,
        rows: Sequence[Row],
        attached: Mapping[str, str] | None = None,
        metadata: Mapping[str, str] | None = None,
    ) -> None:
        """Store the rows of a run, which is done from then on.

        Parameters
        ----------
        run : int
        rows : sequence of Row
        attached : mapping of str to str
            SHA-256 of files that belong to the run, by kind.
        metadata : mapping of str to str
            For readers of Parquet.
        """
        content = self.format.encode(rows, self.row, Seal(self.study, run, attached or {}), metadata or {})
        write_whole(self.path(run), lambda file: file.write_bytes(content))

    def survey(self) -> Survey:
        """What stands in the folder; every part is read and its checksum compared."""
        intact: dict[int, Seal] = {}
        damaged: dict[int, str] = {}
        strays: dict[Path, str] = {}
        for path in sorted(self.folder.iterdir()) if self.folder.is_dir() else ():
            name = _NAME.fullmatch(path.stem)
            run = int(name[1]) if name else -1
            if path.name.startswith("."):
                continue
            if path != self.path(run):
                strays[path] = "not the name of a part"
                continue
            if self.runs is not None and run >= self.runs:
                strays[path] = "none of the study's runs"
                continue
            try:
                seal = read_seal(path.read_bytes())
            except OSError as error:
                damaged[run] = f"it cannot be read ({error.strerror})"
            except ValueError as error:
                damaged[run] = str(error)
            else:
                if seal.study != self.study:
                    strays[path] = "a part of another study"
                elif seal.run != run:
                    strays[path] = f"a copy of the part of run {seal.run}"
                else:
                    intact[run] = seal
        return Survey(intact, damaged, strays)

    def rows(self, runs: Sequence[int]) -> list[Row]:
        """The rows of intact parts, in the order of the runs given."""
        return self.format.decode([self.path(run) for run in runs], self.row) if runs else []

    def failed(self, runs: Sequence[int]) -> set[int]:
        """Those of some intact parts that have a row with an ``error``."""
        return {run for run in runs if any(row.error for row in self.format.decode([self.path(run)], self.row))}


def part_name(run: int) -> str:
    """The name of a run's files, without suffix."""
    return f"run-{run:06d}"
