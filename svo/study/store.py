"""The folder of a study: part files that survive a kill, and the table, alarms and samples read back.

A run is done when its part of ``runs.parquet`` stands; that part is written last, and every file appears whole or
not at all (written under another name, then renamed).
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from svo.alarms import write_alarms
from svo.study.configuration import StudyConfiguration, versions
from svo.study.exemplar import Exemplar
from svo.study.run import RunOutcome, RunRow

_TYPES = {
    "run": "int64",
    "seed": "int64",
    "fault": "string",
    "profile": "string",
    "noise": "string",
    "first_alarm_s": "float64",
    "detection_delay_s": "float64",
    "isolation_delay_s": "float64",
    "isolated_as": "string",
    "false_alarm": "bool",
    "wrong_isolation": "bool",
    "alive_end": "string",
    "microseconds_per_step": "float64",
    "microseconds_p99": "float64",
    "undecided": "int64",
    "architecture": "string",
}


@dataclass(frozen=True)
class StudyFolder:
    """Where a study keeps its files."""

    path: Path

    @property
    def parts(self) -> Path:
        return self.path / "runs.parquet"

    @property
    def alarms(self) -> Path:
        return self.path / "alarms.jsonl"

    def check(self, configuration: StudyConfiguration, resume: bool) -> None:
        """Raise an error if the study cannot be run into this folder.

        Raises
        ------
        ValueError
            If the folder is not empty and ``resume`` is False, or holds something else than this very study
            (configuration and versions of the software).
        """
        if self.path.exists() and any(self.path.iterdir()):
            if not resume:
                raise ValueError(
                    f"{self.path} is not empty; give --resume to go on with the study in it, or another folder"
                )
            self._check_same(configuration)

    def open(self, configuration: StudyConfiguration, resume: bool) -> set[int]:
        """Make the folder ready and return the numbers of the runs that it already holds; raises as `check`."""
        self.check(configuration, resume)
        self.path.mkdir(parents=True, exist_ok=True)
        if not self._identity.exists():
            text = json.dumps({"configuration": configuration.to_dict(), "versions": versions()}, indent=2) + "\n"
            write_whole(self._identity, lambda file: file.write_text(text, encoding="utf-8"))
        for part in (self.parts, self._alarm_parts, self._exemplars):
            part.mkdir(exist_ok=True)
            for unfinished in part.glob(".*"):
                unfinished.unlink()
        return {int(part.stem.removeprefix("run-")) for part in self.parts.glob("run-*.parquet")}

    def write(self, outcome: RunOutcome, configuration: StudyConfiguration) -> None:
        """Store a run; its part of the table comes last."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        name = f"run-{outcome.row.run:06d}"
        if outcome.alarms:
            write_whole(self._alarm_parts / f"{name}.jsonl", lambda file: write_alarms(file, outcome.alarms))
        if outcome.exemplar is not None:
            write_whole(self._exemplars / f"{name}.npz", outcome.exemplar.save)
        metadata = {"svo.configuration": json.dumps(configuration.to_dict()), "svo.versions": json.dumps(versions())}
        schema = pa.schema([(key, pa.type_for_alias(kind)) for key, kind in _TYPES.items()], metadata=metadata)
        table = pa.Table.from_pylist([asdict(outcome.row)], schema=schema)
        write_whole(self.parts / f"{name}.parquet", lambda file: pq.write_table(table, file))

    def join_alarms(self) -> None:
        """Make one ``alarms.jsonl`` of the runs' alarms, in the order of the runs."""
        if not self._alarm_parts.exists():
            return
        if not self.alarms.exists():  # else a kill came between joining and removing
            parts = sorted(self._alarm_parts.glob("run-*.jsonl"))
            write_whole(self.alarms, lambda file: _concatenate(parts, file))
        shutil.rmtree(self._alarm_parts)

    def rows(self) -> list[RunRow]:
        """The run table, in the order of the runs."""
        import pyarrow.parquet as pq

        table = pq.read_table(self.parts, columns=list(_TYPES))
        return sorted((RunRow(**row) for row in table.to_pylist()), key=lambda row: row.run)

    def exemplars(self) -> Iterable[Exemplar]:
        """The exemplary runs, one after the other."""
        return (Exemplar.load(path) for path in sorted(self._exemplars.glob("run-*.npz")))

    def identity(self) -> dict[str, Any]:
        """Configuration and versions, as stored.

        Raises
        ------
        ValueError
            If the folder has no ``study.json``, or not that of a study.
        """
        if not self._identity.exists():
            raise ValueError(f"{self.path} holds no study (study.json is missing); expected a folder of svo study")
        stored = json.loads(self._identity.read_text(encoding="utf-8"))
        if not (isinstance(stored, dict) and isinstance(stored.get("configuration"), dict)):
            raise ValueError(f"{self._identity} is not that of a study; expected an object with a configuration")
        return stored

    @property
    def _identity(self) -> Path:
        return self.path / "study.json"

    @property
    def _alarm_parts(self) -> Path:
        return self.path / "alarms"

    @property
    def _exemplars(self) -> Path:
        return self.path / "exemplars"

    def _check_same(self, configuration: StudyConfiguration) -> None:
        if not self._identity.exists():
            raise ValueError(
                f"{self.path} is not empty and holds no study (study.json is missing); choose another folder"
            )
        stored = self.identity()
        was = stored["configuration"] | stored["versions"]
        now = configuration.to_dict() | versions()
        different = [
            f"{key} was {was.get(key)!r}, now {now[key]!r}"
            for key in now
            if key != "machine" and was.get(key) != now[key]
        ]
        if different:
            raise ValueError(
                f"{self.path} holds another study ({'; '.join(different)}); "
                "resume with the same configuration and versions, or choose another folder"
            )


def write_whole(path: Path, write: Callable[[Path], Any]) -> None:
    """Write a file under another name, then rename it: it appears whole or not at all."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    write(temporary)
    temporary.replace(path)


def _concatenate(parts: list[Path], target: Path) -> None:
    with target.open("wb") as out:
        for part in parts:
            out.write(part.read_bytes())
