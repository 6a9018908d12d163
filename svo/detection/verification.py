"""Alarms checked again: stored ones, or those of a detection that is at hand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from polytopes.shown import Shown, in_a_line
from polytopes.signatures import options_by_name
from svo.checks import expect_kind
from svo.detection.chains import PlantModels, with_chains
from svo.detection.found import Detection
from svo.detection.proof_file import ProofFile
from svo.isolation import NOT_CHECKED, Alarm, AlarmCheck, check_alarm, verify_alarms
from svo.isolation.alarms import numbered_alarms
from svo.logs.log import Log
from svo.observers.window.certificate import BOUNDS_OF_S
from svo.plant import MonitoredPlant
from svo.plant.description import find_plant
from svo.plant.log_file import read_log
from svo.terminal import line

_SHOWN = 20  # failed checks
_START, _MODEL = "the set at the start of each window", "that the model in each record is the plant's"


@dataclass(frozen=True, repr=False)
class Verification(Shown):
    """What came of checking alarms; printed, it says what ``svo verify`` says.

    Attributes
    ----------
    about : str
        What was checked: the file, or the detection.
    checks : tuple of AlarmCheck
        One an alarm, in their order.
    given : str
        What was not checked, and is taken as given; empty if each check says what its proof rests on.
    """

    about: str
    checks: tuple[AlarmCheck, ...]
    given: str = ""

    @property
    def ok(self) -> bool:
        """Whether there is an alarm, and every one is proven."""
        return bool(self.checks) and self.proven == len(self.checks)

    @property
    def proven(self) -> int:
        """How many of the alarms are."""
        return sum(check.ok for check in self.checks)

    @property
    def summary(self) -> str:
        """How many were proven, in one line."""
        if not self.checks:
            return f"{self.about}: there is no alarm, so there is nothing to prove"
        seconds = sum(check.seconds for check in self.checks)
        proven = f"{self.proven} of {len(self.checks)} alarms proven in exact arithmetic"
        reasons = [check.reason for check in self.checks if check.ok]
        left_out = [text for text in NOT_CHECKED.values() if any(text in reason for reason in reasons)]
        given = f", given {self._given(reasons)}" if self.given and self.proven else ""
        return f"{self.about}: {proven}{given}, in {seconds:.2f} s" + (f" ({'; '.join(left_out)})" if left_out else "")

    def _given(self, reasons: Sequence[str]) -> str:
        """What is taken as given, with the bounds of s if any proof takes these."""
        bounds = f" and {BOUNDS_OF_S}" if any(BOUNDS_OF_S in reason for reason in reasons) else ""
        return self.given.replace(_START, _START + bounds)

    @property
    def failures(self) -> list[str]:
        """The alarms that are not proven and why, a line each; of many, the first."""
        failed = [check for check in self.checks if not check.ok]
        more = [f"{self.about}: {len(failed) - _SHOWN} more that failed (--json lists all)"] if failed[_SHOWN:] else []
        return [f"{self.about}, {_which(check)}: {check.reason}" for check in failed[:_SHOWN]] + more

    def to_dict(self) -> list[dict[str, Any]]:
        """The checks for JSON, without their times."""
        return [
            {"line": c.line, "observer": c.observer, "sample": c.sample, "ok": c.ok, "reason": c.reason}
            for c in self.checks
        ]

    def __str__(self) -> str:
        return "\n".join(line(text) for text in (*self.failures, self.summary))

    def __repr__(self) -> str:
        return in_a_line(f"<Verification of {self.summary}>")


def _which(check: AlarmCheck) -> str:
    whose = f"{check.observer}, sample {check.sample}"
    if not check.line:
        return whose
    return f"line {check.line}" + (f" ({whose})" if check.sample >= 0 else "")


@options_by_name
def verify(
    alarms: Detection | str | Path,
    log: Log | str | Path | None = None,
    *,
    full: bool = False,
    plant: MonitoredPlant | None = None,
    write_proof: str | Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Verification:
    """Check alarms: the digest of those stored, each proof in exact arithmetic, and data and model if the log is given.

    A window's proof is conditional on the set of states at its start, and on the model that is stored with it; with a
    log that is compared with the plant's.

    Parameters
    ----------
    alarms : Detection or path
        What `svo.detect` found, or an alarms.jsonl.
    log : Log or path, optional
        The log that stored alarms are of; a detection brings its own.
    full : bool
        Also prove each alarm from the plant's model and the log alone, without the set that the record takes as given.
    plant : MonitoredPlant, optional
        The one that stored alarms are of; by default it is found by its name, a description beside them.
    write_proof : path, optional
        With ``full``: every step of the proofs is written there, for checkers of others (`docs/proof_format.md`), each
        chain when it is proven. What an interrupted call has written is kept, if it is proven again.
    progress : callable, optional
        With ``full``: called with (alarms done, alarms in all) as they are done.

    Returns
    -------
    Verification
        Printed, it says how many alarms are proven, and why others are not.

    Raises
    ------
    TypeError
        If ``alarms`` is neither a detection nor a path.
    ValueError
        If the file is none of alarms, or has those of several runs and a log is given, if the plant is not found, and
        for ``full`` without a log, for ``write_proof`` without ``full`` or where no proof can be written, or a log or
        plant beside a detection.
    OSError
        If a file cannot be opened.
    """
    expect_kind("alarms", alarms, (Detection, str, Path), "what svo.detect gives, or the path of an alarms.jsonl")
    if write_proof is not None and not full:
        raise ValueError("write_proof is given and full is not True; the steps of a proof come with it")
    whole = _Whole(None if write_proof is None else Path(write_proof), progress) if full else None
    if not isinstance(alarms, Detection):
        return _verified_file(Path(alarms), log, whole, plant)
    if log is not None or plant is not None:
        raise ValueError("log or plant is given beside a detection, which has its own; leave them out")
    models = PlantModels(alarms.plant, alarms.log)
    checks = [check_alarm(alarm, alarms.log, models.difference) for alarm in alarms.alarms]
    about = f"alarms of {alarms.log.source or 'the log'}"
    return Verification(about, _completed(checks, alarms.alarms, models, whole), "" if full else _START)


class _Whole(NamedTuple):
    """What is asked of whole proofs: the file they are written to, and who is told how far they are."""

    out: Path | None
    progress: Callable[[int, int], None] | None


def _verified_file(
    path: Path, log: Log | str | Path | None, whole: _Whole | None, plant: MonitoredPlant | None
) -> Verification:
    if log is None and whole is not None:
        raise ValueError("full is True and there is no log; give the log that the alarms are of")
    numbered = [] if log is None else _of_one_run(path)
    if log is None or not numbered:
        return Verification(str(path), tuple(verify_alarms(path)), f"{_START}, and {_MODEL}")
    # A description lies beside the alarms, where `Detection.save` put it.
    alarms = [alarm for _, alarm in numbered]
    found = plant or find_plant(str(alarms[0].source.get("plant")), path.parent)
    data = log if isinstance(log, Log) else read_log(log, found)
    models = PlantModels(found, data)
    checks = [replace(check_alarm(alarm, data, models.difference), line=number) for number, alarm in numbered]
    return Verification(str(path), _completed(checks, alarms, models, whole), "" if whole is not None else _START)


def _completed(
    checks: Sequence[AlarmCheck], alarms: Sequence[Alarm], models: PlantModels, whole: _Whole | None
) -> tuple[AlarmCheck, ...]:
    """The checks, with whole proofs if all hold and these are asked for, which are then written."""
    if whole is None or not all(check.ok for check in checks):
        return tuple(checks)
    out = ProofFile(whole.out, alarms[0].source) if whole.out is not None and alarms else None
    found = with_chains(checks, alarms, models, None if out is None else out.add, whole.progress)
    if whole.out is not None and (out is None or not out.chains):
        raise ValueError(f"no proof can be written: {found[0].reason if found else 'there is no alarm'}")
    if out is not None:
        out.close()
    return tuple(found)


def _of_one_run(path: Path) -> list[tuple[int, Alarm]]:
    """The alarms of a file with their lines, which a log can be given for."""
    alarms = numbered_alarms(path)
    runs = [{key: value for key, value in alarm.source.items() if key != "model"} for _, alarm in alarms]
    if any(run != runs[0] for run in runs):
        raise ValueError(
            f"{path} has alarms of several runs, and a log is that of one; give the alarms of that run alone"
        )
    return alarms
