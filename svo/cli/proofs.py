"""Proofs of alarms."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import svo as face
from svo.cli.frame import app, one_line_errors
from svo.cli.options import AsJson
from svo.cli.output import print_checks, print_json

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
    if log is not None and full is not None:
        raise ValueError("--log and --full were both given; --full LOG compares the data too, so leave --log out")
    from svo.cli.progress import busy

    with busy("Proving"):
        found = face.verify(alarms, log or full, full=full is not None)
    if not found.checks:
        # Success would say that something was proven.
        raise ValueError(f"{alarms} holds no alarm, so there is nothing to prove: {_WHY_EMPTY}")
    if as_json:
        print_json(found.to_dict())
    else:
        print_checks(found)
    if not found.ok:
        raise typer.Exit(1)
