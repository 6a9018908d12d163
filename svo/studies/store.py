"""The folder of a study of runs: its identity, the parts of its table, its alarms and samples of exemplary runs.

A run is done when its part of ``runs.parquet`` stands: it is written last, after its alarms and samples, whose
digests it holds. Parts that are damaged, copied, or of another study are found by their seals (`svo.store`).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar, Generic

from svo.store import (
    Identity,
    Joined,
    Parts,
    Survey,
    clear_results,
    digest_of,
    locked,
    make_folder,
    versions,
    write_whole,
)
from svo.store.lock import check_free
from svo.store.parts import Row, part_name
from svo.studies.attempt import Failed
from svo.studies.configuration import Job, StudyConfiguration

FORMAT = "svo-study-3"
ALARMS, SAMPLES = "alarms", "exemplar"  # what belongs to a run beside its rows
_SHOWN = 5
_PICTURES = ("*.png", "*.svg", "*.pdf")


Written = Mapping[str, Callable[[Path], Any]]


@dataclass(frozen=True)
class StudyStore(Generic[Row]):
    """Where a study keeps its files.

    A subclass names the dataclass of its rows, whose ``error`` says why a run failed and is None otherwise; its class
    method ``failed(job, error)`` makes the only row of such a run.
    """

    path: Path
    row: ClassVar[type[Any]]

    @property
    def parts(self) -> Path:
        return self.path / "runs.parquet"

    @property
    def alarms(self) -> Path:
        return self.path / "alarms.jsonl.gz"

    def check(self, configuration: StudyConfiguration, resume: bool) -> list[str]:
        """Raise an error if the study cannot be run into this folder; returns what a user should know about it.

        Raises
        ------
        ValueError
            If the folder is not empty and ``resume`` is False, holds something else than this very study
            (configuration and versions of the software), another process is at work in it, or its
            ``alarms.jsonl.gz`` is not what the study wrote.
        """
        if not self.path.is_dir():
            return []
        check_free(self.path)
        return self._check_content(configuration, resume)

    def clear(self, resume: bool, added: Sequence[str] = ()) -> None:
        """Remove a study from its folder, so that another one can begin there.

        ``added`` names the folders of what its plant adds to a study; errors as `svo.store.clear_results`.
        """
        expect_one_way(resume)
        own = ("runs.parquet", "alarms*", "exemplars", "*.csv", "*.html", *_PICTURES, *added)
        clear_results(self.path, self._identity.name, own)

    @contextmanager
    def open(
        self, configuration: StudyConfiguration, runs: int, *, resume: bool, retry_failed: bool = False
    ) -> Iterator[set[int]]:
        """Make the folder ready, keep other processes out of it, and give those of the runs that it holds already.

        ``retry_failed`` says that a run that failed is not done.

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
                _identity(configuration, runs).write(self._identity)
            for folder in (self.parts, self._joined.folder):
                make_folder(folder)
            self._exemplars.mkdir(exist_ok=True)
            seals = self._survey().intact
            lost = self._joined.missing(_digests(seals, ALARMS))
            samples = _digests(seals, SAMPLES)
            lost |= {run for run, digest in samples.items() if not _is_intact(self.samples(run), digest)}
            done = set(seals) - lost
            if retry_failed:
                done -= self._parts().failed(sorted(done))
            if len(done) < runs:
                self._joined.take_apart({run: d for run, d in _digests(seals, ALARMS).items() if run in done})
            yield done

    def contents(self, outcome: Any) -> tuple[Sequence[Row], Written]:
        """The rows of a run that was done, and what writes the files that belong to it, by kind."""
        return outcome, {}

    def keep(self, configuration: StudyConfiguration, job: Job, outcome: Any) -> None:
        """Store a run: the files that belong to it, and last its part of the table."""
        failed = isinstance(outcome, Failed)
        rows, files = ([self.row.failed(job, outcome.error)], {}) if failed else self.contents(outcome)
        digests, places = {}, {ALARMS: self._joined.part(job.run), SAMPLES: self.samples(job.run)}
        for kind, write in files.items():
            write_whole(places[kind], write)
            digests[kind] = digest_of(places[kind])
        metadata = {"svo.configuration": json.dumps(configuration.to_dict()), "svo.versions": json.dumps(versions())}
        self._parts(_identity(configuration)).write(job.run, rows, digests, metadata)

    def join_alarms(self) -> None:
        """Make one ``alarms.jsonl.gz`` of the runs' alarms, in the order of the runs; errors as `check`."""
        self._joined.join(_digests(self._survey().intact, ALARMS))

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

    def with_samples(self, without_damaged: bool = False) -> list[int]:
        """The runs whose samples are kept (`samples` has the files); errors as `rows`."""
        every = sorted(_digests(self._survey().intact, SAMPLES).items())
        bad = [run for run, digest in every if not _is_intact(self.samples(run), digest)]
        if bad and not without_damaged:
            raise self._damaged([f"{self.samples(run)}: missing, or its checksum does not match" for run in bad])
        return [run for run, _ in every if run not in bad]

    def samples(self, run: int) -> Path:
        return self._exemplars / f"{part_name(run)}.npz"

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
        return Joined(self.alarms, self.path / "alarms", _run_of)

    @property
    def _identity(self) -> Path:
        return self.path / "study.json"

    @property
    def _exemplars(self) -> Path:
        return self.path / "exemplars"

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
                f"{self.path} is not empty; give --resume to go on with the study in it, --overwrite to begin another "
                "one in its place, or another folder"
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


def expect_one_way(resume: bool) -> None:
    """Refuse to go on with a study that is to be overwritten."""
    if resume:
        raise ValueError("--resume and --overwrite were both given; go on with what is there, or begin anew")


def _identity(configuration: StudyConfiguration, runs: int | None = None) -> Identity:
    return Identity(FORMAT, configuration.to_dict(), versions(), runs)


def _run_of(records: bytes) -> int:
    """The run that the alarms of a part are from."""
    return int(json.loads(records.partition(b"\n")[0])["source"]["run"])


def _digests(seals: Mapping[int, Any], kind: str) -> dict[int, str]:
    return {run: seal.attached[kind] for run, seal in seals.items() if kind in seal.attached}


def _is_intact(path: Path, digest: str) -> bool:
    return path.is_file() and digest_of(path) == digest


def _strays(survey: Survey) -> list[str]:
    every = [f"{path} is {why}; ignored" for path, why in survey.strays.items()]
    return every[:_SHOWN] + ([f"{len(every) - _SHOWN} more files that are ignored"] if len(every) > _SHOWN else [])
