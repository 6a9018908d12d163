"""The folder of a comparison: what each of its tasks gave, so that it goes on after an interruption."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from svo.detectors.detector import Setting
from svo.store import Identity, Parts, clear_results, locked, make_folder, versions
from svo.store.tables import Json
from svo.studies.comparison.run import ComparedRun
from svo.studies.comparison.tuning import Tuned
from svo.studies.store import expect_one_way

FORMAT = "svo-comparison-2"


@dataclass(frozen=True)
class TunedRow:
    """A `Tuned` as plain data, or why there is none."""

    level: float
    parameters: dict[str, float]
    learned: dict[str, Any]
    cost: float
    evaluations: int
    error: str | None = None

    @classmethod
    def failed(cls, error: str) -> TunedRow:
        return cls(np.nan, {}, {}, np.nan, 0, error)

    @classmethod
    def of(cls, tuned: Tuned) -> TunedRow:
        setting = tuned.setting
        parameters = {name: float(value) for name, value in setting.parameters.items()}
        learned = {name: np.asarray(value, dtype=float).tolist() for name, value in setting.learned.items()}
        return cls(float(setting.level), parameters, learned, float(tuned.cost), int(tuned.evaluations))

    def tuned(self) -> Tuned:
        learned = {name: np.array(value, dtype=float) for name, value in self.learned.items()}
        return Tuned(Setting(self.level, self.parameters, learned), self.cost, self.evaluations)


@dataclass(frozen=True)
class ComparisonParts:
    """One part for each detector that is tuned, and one for each group of judged runs."""

    tuned: Parts[TunedRow]
    judged: Parts[ComparedRun]


def clear_comparison(out: Path, resume: bool) -> None:
    """Remove a comparison from a folder, so that another one can begin there; errors as `svo.store.clear_results`."""
    expect_one_way(resume)
    clear_results(out, "comparison.json", ("tuned", "judged", "*.csv", "*.png"))


@contextmanager
def comparison_parts(out: Path | None, configuration: Mapping[str, Any], resume: bool) -> Iterator[ComparisonParts]:
    """The parts of a comparison in a folder, with other processes kept out of it; without one they are not kept.

    Raises
    ------
    ValueError
        If the folder holds a comparison and ``resume`` is False, or another comparison, or another process is at
        work in it.
    """
    if out is None:
        with TemporaryDirectory() as passing, comparison_parts(Path(passing), configuration, resume) as parts:
            yield parts
        return
    folder, now = out, Identity(FORMAT, configuration, versions())
    folder.mkdir(parents=True, exist_ok=True)
    identity = folder / "comparison.json"
    with locked(folder):
        if not identity.exists():
            now.write(identity)
        elif not resume:
            raise ValueError(f"{folder} holds a comparison already; give --resume to go on with it, or another folder")
        else:
            Identity.read(identity, FORMAT).check_same(now, folder)
        parts = ComparisonParts(
            Parts(folder / "tuned", TunedRow, now.digest, Json()),
            Parts(folder / "judged", ComparedRun, now.digest, Json()),
        )
        make_folder(parts.tuned.folder)
        make_folder(parts.judged.folder)
        yield parts
