"""Proofs of alarms."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from svo.cli.frame import app, one_line_errors
from svo.cli.options import AsJson
from svo.cli.output import print_checks, print_json

if TYPE_CHECKING:
    from svo.alarms import Alarm, AlarmCheck
    from svo.log import Log
    from svo.plant import MonitoredPlant


@app.command()
def verify(
    alarms: Annotated[
        Path, typer.Argument(metavar="ALARMS", help="An alarms.jsonl of `svo study`, `svo detect` or `svo watch`.")
    ],
    log: Annotated[
        Path | None, typer.Option(metavar="LOG", help="Also compare the alarms' data with this log.")
    ] = None,
    full: Annotated[
        Path | None,
        typer.Option(metavar="LOG", help="Also prove every bound from the first sample of this log to each alarm."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Check every stored alarm: its digest, its proof in exact arithmetic, and its data if the log is given.

    A window's proof is conditional on the set of states at its start. With --full the plant's observers are run
    over the log again, and every bound from the first sample to the alarm is proven in exact arithmetic (some
    seconds an alarm). The exit code is 1 if any alarm fails.

    \b
    Example:
      svo verify findings/alarms.jsonl --full log.csv
    """
    with one_line_errors():
        checks = _checks(alarms, log, full)
        if as_json:
            print_json(
                [
                    {"line": c.line, "observer": c.observer, "sample": c.sample, "ok": c.ok, "reason": c.reason}
                    for c in checks
                ]
            )
        else:
            print_checks(alarms, checks)
    if not all(check.ok for check in checks):
        raise typer.Exit(1)


def _checks(path: Path, log: Path | None, full: Path | None) -> list[AlarmCheck]:
    from svo.alarms import read_alarms, verify_alarms

    alarms = [] if log is None and full is None else read_alarms(path)
    if full is None:
        return verify_alarms(path, None if log is None else _log_of(path, alarms, log))
    if log is not None:
        raise ValueError("--log and --full were both given; --full LOG compares the data too, so leave --log out")
    from svo.verification import verify_chains

    data = _log_of(path, alarms, full)
    return [] if data is None else verify_chains(path, data, _plant_of(path, alarms))


def _plant_of(path: Path, alarms: Sequence[Alarm]) -> MonitoredPlant:
    """The plant whose model alarms are about; a description lies beside them, where `svo detect` put it."""
    from svo.description import find_plant

    return find_plant(str(alarms[0].source.get("plant")), path.parent)


def _log_of(path: Path, alarms: Sequence[Alarm], log: Path) -> Log | None:
    """The log to compare alarms with, read by the columns of their plant; None if there are no alarms."""
    from svo.log_file import read_log

    if not alarms:
        return None
    if any(alarm.source != alarms[0].source for alarm in alarms):
        raise ValueError(
            f"{path} has alarms of several runs, and a log is that of one; give the alarms of that run alone"
        )
    plant = _plant_of(path, alarms)
    return read_log(log, plant.columns, plant.Ts)
