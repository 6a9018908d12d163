"""Proofs of alarms."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from svo.cli.frame import app, one_line_errors
from svo.cli.options import AsJson
from svo.cli.output import print_checks, print_json

if TYPE_CHECKING:
    from svo.isolation import AlarmCheck


_WHY_EMPTY = "no model was falsified in what wrote it, or the file was cut off"


@app.command()
@one_line_errors()
def verify(
    alarms: Annotated[
        Path, typer.Argument(metavar="ALARMS", help="An alarms.jsonl of `svo study`, `svo detect` or `svo watch`.")
    ],
    log: Annotated[
        Path | None,
        typer.Option(metavar="LOG", help="Also compare the alarms' data with this log, and models with the plant."),
    ] = None,
    full: Annotated[
        Path | None,
        typer.Option(metavar="LOG", help="Also prove every bound from the first sample of this log to each alarm."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Check every stored alarm: its digest, its proof in exact arithmetic, and its data if the log is given.

    A window's proof is conditional on the set of states at its start, and on the model that is stored with it; with a
    log that is compared with the plant's. With --full the plant's observers are run
    over the log again, and every bound from the first sample to the alarm is proven in exact arithmetic (some
    seconds an alarm). The exit code is 1 if any alarm fails, and if there is none.

    \b
    Example:
      svo verify findings/alarms.jsonl --full log.csv
    """
    checks = _checks(alarms, log, full)
    if not checks:
        # Success would say that something was proven.
        raise ValueError(f"{alarms} holds no alarm, so there is nothing to prove: {_WHY_EMPTY}")
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
    from svo.isolation import read_alarms, verify_alarms

    if log is not None and full is not None:
        raise ValueError("--log and --full were both given; --full LOG compares the data too, so leave --log out")
    wanted = log or full
    if wanted is None:
        return verify_alarms(path)
    alarms = read_alarms(path)
    if not alarms:
        return []
    if any(alarm.source != alarms[0].source for alarm in alarms):
        raise ValueError(
            f"{path} has alarms of several runs, and a log is that of one; give the alarms of that run alone"
        )
    from svo.logs.file import read_log
    from svo.plant.description import find_plant

    # A description lies beside the alarms, where `svo detect` put it.
    plant = find_plant(str(alarms[0].source.get("plant")), path.parent)
    data = read_log(wanted, plant.columns, plant.Ts)
    from svo.detection.verification import PlantModels, verify_chains

    if full is None:
        return verify_alarms(path, data, PlantModels(plant, data).difference)
    return verify_chains(path, data, plant)
