"""The folder of a study: its identity, the parts of its table, its alarms and exemplary runs.

A run is done when its part of ``runs.parquet`` stands: it is written last, after its alarms and samples, whose
digests it holds. Parts that are damaged, copied, or of another study are found by their seals (`svo.store`).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, Generic

from svo.isolation.alarms import write_alarms
from svo.store import Identity, Joined, Parts, Survey, digest_of, locked, versions, write_whole
from svo.store.lock import check_free
from svo.store.parts import Row, part_name
from svo.studies.configuration import StudyConfiguration
from svo.studies.isolation.exemplar import Exemplar
from svo.studies.isolation.run import RunOutcome, RunRow

FORMAT = "svo-study-2"
_ALARMS, _EXEMPLAR = "alarms", "exemplar"  # what belongs to a run beside its rows
_SHOWN = 5


@dataclass(frozen=True)
class StudyStore(Generic[Row]):
    """Where a study keeps its files; a subclass names the dataclass of its rows."""

    path: Path
    row: ClassVar[type[Any]]

    @property
    def parts(self) -> Path:
        return self.path / "runs.parquet"

    @property
    def alarms(self) -> Path:
        return self.path / "alarms.jsonl"

    def check(self, configuration: StudyConfiguration, resume: bool) -> list[str]:
        """Raise an error if the study cannot be run into this folder; returns what a user should know about it.

        Raises
        ------
        ValueError
            If the folder is not empty and ``resume`` is False, holds something else than this very study
            (configuration and versions of the software), another process is at work in it, or its ``alarms.jsonl``
            is not what the study wrote.
        """
        if not self.path.is_dir():
            return []
        check_free(self.path)
        return self._check_content(configuration, resume)

    @contextmanager
    def open(self, configuration: StudyConfiguration, runs: Collection[int], resume: bool) -> Iterator[set[int]]:
        """Make the folder ready, keep other processes out of it, and give those of the runs that it holds already.

        Raises
        ------
        ValueError
            As `check`.
        """
        self.check(configuration, resume)
        self.path.mkdir(parents=True, exist_ok=True)
        with locked(self.path):
            self._check_content(configuration, resume)
            if not self._identity.exists():
                _identity(configuration, len(runs)).write(self._identity)
            self._parts().make()
            self._joined.make()
            self._exemplars.mkdir(exist_ok=True)
            seals = self._survey().intact
            lost = self._joined.missing(_digests(seals, _ALARMS))
            samples = _digests(seals, _EXEMPLAR)
            lost |= {run for run, digest in samples.items() if not _is_intact(self._exemplar(run), digest)}
            done = {run for run in runs if run in seals and run not in lost}
            if len(done) < len(runs):
                self._joined.take_apart({run: d for run, d in _digests(seals, _ALARMS).items() if run in done})
            yield done

    def store(
        self,
        run: int,
        rows: list[Row],
        configuration: StudyConfiguration,
        attached: Mapping[str, tuple[Path, Callable[[Path], Any]]] | None = None,
    ) -> None:
        """Store a run: the files that belong to it, and last its part of the table."""
        digests = {}
        for kind, (path, write) in (attached or {}).items():
            write_whole(path, write)
            digests[kind] = digest_of(path)
        metadata = {"svo.configuration": json.dumps(configuration.to_dict()), "svo.versions": json.dumps(versions())}
        self._parts(_identity(configuration)).write(run, rows, digests, metadata)

    def join_alarms(self) -> None:
        """Make one ``alarms.jsonl`` of the runs' alarms, in the order of the runs; errors as `check`."""
        self._joined.join(_digests(self._survey().intact, _ALARMS))

    def rows(self, without_damaged: bool = False) -> list[Row]:
        """The run table, in the order of the runs.

        Raises
        ------
        ValueError
            If there is no intact part, or if parts are damaged, unless these are to be left out.
        """
        survey = self._survey()
        if survey.damaged and not without_damaged:
            raise self._damaged([f"{self._parts().path(run)}: {why}" for run, why in survey.damaged.items()])
        if not survey.intact:
            raise ValueError(f"{self.path} holds no finished run yet; its report needs one")
        return self._parts().rows(sorted(survey.intact))

    def exemplars(self, without_damaged: bool = False) -> list[Exemplar]:
        """The exemplary runs; errors as `rows`."""
        samples = sorted(_digests(self._survey().intact, _EXEMPLAR).items())
        bad = [run for run, digest in samples if not _is_intact(self._exemplar(run), digest)]
        if bad and not without_damaged:
            raise self._damaged([f"{self._exemplar(run)}: missing, or its checksum does not match" for run in bad])
        return [Exemplar.load(self._exemplar(run)) for run, _ in samples if run not in bad]

    def notes(self) -> list[str]:
        """What a reader of the folder's results should know about it: what is damaged, and what is ignored."""
        survey = self._survey()
        left = [f"{self._parts().path(run)}: {why}; left out" for run, why in survey.damaged.items()]
        return left + _strays(survey)

    def identity(self) -> dict[str, Any]:
        """Configuration and versions, as stored.

        Raises
        ------
        ValueError
            If the folder has no ``study.json``, or not that of a study of this version.
        """
        return asdict(self._stored())

    def _stored(self) -> Identity:
        if not self._identity.is_file():
            raise ValueError(f"{self.path} holds no study (study.json is missing); expected a folder of svo study")
        stored = Identity.read(self._identity, FORMAT)
        try:
            StudyConfiguration.from_dict(stored.configuration)
        except ValueError as error:
            raise ValueError(f"{self._identity} is not that of a study: {error}") from error
        return stored

    def _survey(self) -> Survey:
        return self._parts().survey()

    def _parts(self, identity: Identity | None = None) -> Parts[Row]:
        known = identity or self._stored()
        return Parts(self.parts, self.row, known.digest, runs=known.runs)

    @property
    def _joined(self) -> Joined:
        return Joined(self.alarms, self.path / "alarms", lambda line: int(json.loads(line)["source"]["run"]))

    @property
    def _identity(self) -> Path:
        return self.path / "study.json"

    @property
    def _exemplars(self) -> Path:
        return self.path / "exemplars"

    def _exemplar(self, run: int) -> Path:
        return self._exemplars / f"{part_name(run)}.npz"

    def _damaged(self, lines: list[str]) -> ValueError:
        more = f"; and {len(lines) - _SHOWN} more" if len(lines) > _SHOWN else ""
        return ValueError(
            f"{'; '.join(lines[:_SHOWN])}{more}. `svo study ... --resume` computes what is damaged again; "
            f"`svo report {self.path} --without-damaged` goes on without it"
        )

    def _check_content(self, configuration: StudyConfiguration, resume: bool) -> list[str]:
        if all(entry.name.startswith(".") for entry in self.path.iterdir()):
            return []
        if not resume:
            raise ValueError(
                f"{self.path} is not empty; give --resume to go on with the study in it, or another folder"
            )
        self._check_same(configuration)
        self._joined.check()
        survey = self._survey()
        again = [f"{self._parts().path(run)}: {why}; run {run} is done again" for run, why in survey.damaged.items()]
        return again + _strays(survey)

    def _check_same(self, configuration: StudyConfiguration) -> None:
        if not self._identity.exists():
            raise ValueError(
                f"{self.path} is not empty and holds no study (study.json is missing); choose another folder"
            )
        self._stored().check_same(_identity(configuration), self.path)


@dataclass(frozen=True)
class StudyFolder(StudyStore[RunRow]):
    """The folder of a study of isolation times."""

    row = RunRow

    def write(self, outcome: RunOutcome, configuration: StudyConfiguration) -> None:
        """Store a run; its part of the table comes last."""
        run, exemplar = outcome.row.run, outcome.exemplar
        attached: dict[str, tuple[Path, Callable[[Path], Any]]] = {}
        if outcome.alarms:
            attached[_ALARMS] = (self._joined.part(run), lambda file: write_alarms(file, outcome.alarms))
        if exemplar is not None:
            attached[_EXEMPLAR] = (self._exemplar(run), exemplar.save)
        self.store(run, [outcome.row], configuration, attached)


def _identity(configuration: StudyConfiguration, runs: int | None = None) -> Identity:
    return Identity(FORMAT, configuration.to_dict(), versions(), runs)


def _digests(seals: Mapping[int, Any], kind: str) -> dict[int, str]:
    return {run: seal.attached[kind] for run, seal in seals.items() if kind in seal.attached}


def _is_intact(path: Path, digest: str) -> bool:
    return path.is_file() and digest_of(path) == digest


def _strays(survey: Survey) -> list[str]:
    every = [f"{path} is {why}; ignored" for path, why in survey.strays.items()]
    return every[:_SHOWN] + ([f"{len(every) - _SHOWN} more files that are ignored"] if len(every) > _SHOWN else [])
