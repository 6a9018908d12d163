"""What a plant adds to its study besides the times of its bank: studies of its own on the same engine, and pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from svo.plant import AddedStudy, Exhibit
from svo.store import Identity, Parts, locked, make_folder, versions
from svo.store.tables import Json
from svo.studies.configuration import StudyConfiguration
from svo.studies.engine import Place, Progress, complete_parts


@runtime_checkable
class AddsStudy(Protocol):
    """What a `Plant` offers besides if there is more to study than the bank's times to detect and isolate."""

    def added_study(self, runs: int, seed: int, noise: Sequence[str]) -> AddedStudy:
        """What comes beside a study of so many ``runs`` of each noise set in ``noise``, from ``seed``."""
        ...


@runtime_checkable
class AddsExhibits(Protocol):
    """What a `Plant` offers besides if its study has more to show than the pictures of its bank."""

    def exhibits(self, folder: Path, runs: int, seed: int, noise: Sequence[str]) -> Sequence[Exhibit]:
        """Write pictures into the ``folder`` of a study of ``runs``, ``seed`` and noise sets ``noise``."""
        ...


def added_study(plant: Any, configuration: StudyConfiguration) -> AddedStudy | None:
    """What a plant adds to a study; None if it adds nothing."""
    if not isinstance(plant, AddsStudy):
        return None
    return plant.added_study(configuration.runs, configuration.seed, configuration.noise)


def run_added(
    added: AddedStudy, folder: Path, place: Place, *, retry_failed: bool = False, progress: Progress | None = None
) -> None:
    """Do what is still to be done of it, in the folder of the study; errors as of the engine."""
    parts = _parts(added, folder)
    parts.folder.parent.mkdir(exist_ok=True)
    with locked(parts.folder.parent):
        make_folder(parts.folder)
        complete_parts(
            partial(_one_row, added.work), added.jobs, parts, lambda job, error: [added.failed(job, error)], place,
            retry_failed=retry_failed, progress=progress,
        )  # fmt: skip


def publish_added(added: AddedStudy, folder: Path) -> list[str]:
    """Write the tables of what is done so far into the folder of the study; as `added_failures`."""
    finished = [row for row in _rows(added, folder).values() if row.error is None]
    if finished:
        added.write(folder, finished)
    return added_failures(added, folder)


def added_failures(added: AddedStudy, folder: Path) -> list[str]:
    """A line for each job that failed: which one, and why."""
    rows = _rows(added, folder).items()
    return [f"run {number} of {added.name} failed: {row.error}" for number, row in rows if row.error is not None]


def _rows(added: AddedStudy, folder: Path) -> dict[int, Any]:
    """By the number of their job."""
    parts = _parts(added, folder)
    done = sorted(parts.survey().intact)
    return dict(zip(done, parts.rows(done), strict=True))


def _parts(added: AddedStudy, folder: Path) -> Parts[Any]:
    study = Identity(f"svo-added-1: {added.name}", added.configuration, versions()).digest
    return Parts(folder / added.name / "rows", added.row, study, Json(), runs=len(added.jobs))


def _one_row(work: Callable[[Any], Any], job: Any) -> list[Any]:
    return [work(job)]
