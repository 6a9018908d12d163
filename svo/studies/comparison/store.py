"""The folder of a comparison: what each of its tasks gave, so that it goes on after an interruption."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from svo.detectors.detector import Setting
from svo.store import Identity, Parts, locked, versions
from svo.store.tables import Json
from svo.studies.comparison.run import ComparedRun
from svo.studies.comparison.tuning import Tuned

if TYPE_CHECKING:
    from svo.studies.comparison.comparison import Comparison

FORMAT = "svo-comparison-1"


@dataclass(frozen=True)
class TunedRow:
    """A `Tuned` as plain data."""

    level: float
    parameters: dict[str, float]
    learned: dict[str, Any]
    cost: float
    evaluations: int

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


@contextmanager
def comparison_parts(folder: Path, comparison: Comparison, resume: bool) -> Iterator[ComparisonParts]:
    """The parts of a comparison in a folder, with other processes kept out of it.

    Raises
    ------
    ValueError
        If the folder holds a comparison and ``resume`` is False, or another comparison, or another process is at
        work in it.
    """
    now = Identity(FORMAT, asdict(comparison) | {"distributions": list(comparison.distributions)}, versions())
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
        parts.tuned.make()
        parts.judged.make()
        yield parts
