"""Proofs of alarms."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path
from typing import Annotated

import typer

import svo as face
from svo.cli.destinations import check_new, writable_file
from svo.cli.frame import app, chosen_noise, one_line_errors
from svo.cli.options import Architecture, AsJson, DescribedName, Models, NoiseName, Overwrite
from svo.cli.output import print_checks, print_json, say

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
        typer.Option(metavar="LOG", help="Also prove each alarm from the plant's model and this log alone."),
    ] = None,
    write_proof: Annotated[
        Path | None,
        typer.Option(
            metavar="PROOF.jsonl.gz",
            help="With --full: write every step of the proofs, for any checker; an interrupted file is gone on with.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Check every stored alarm: its digest, its proof in exact arithmetic, and its data if the log is given.

    A window's proof is conditional on the set of states at its start, and on the model that is stored with it; with a
    log that is compared with the plant's. With --full it is proven from the plant's model and the log alone, with
    every bound that it takes. The exit code is 1 if any alarm fails, and if there is none.

    \b
    Example:
      svo verify findings/alarms.jsonl --full log.csv --write-proof proof.jsonl.gz
    """
    if log is not None and full is not None:
        raise ValueError("--log and --full were both given; --full LOG compares the data too, so leave --log out")
    from svo.cli.progress import busy, progress

    if write_proof is not None and full is None:
        raise ValueError("--write-proof was given without --full LOG, which makes the proof")
    if full is None:
        with busy("Proving"):
            found = face.verify(alarms, log)
    else:
        with progress("Proving alarms") as update:
            found = face.verify(alarms, full, full=True, write_proof=write_proof, progress=update)
    if not found.checks:
        # Success would say that something was proven.
        raise ValueError(f"{alarms} holds no alarm, so there is nothing to prove: {_WHY_EMPTY}")
    if as_json:
        print_json(found.to_dict())
    else:
        print_checks(found)
    if not found.ok:
        raise typer.Exit(1)


@app.command()
@one_line_errors()
def describe(
    plant: DescribedName,
    out: Annotated[Path, typer.Option(metavar="PLANT.json", callback=writable_file, help="File to write.")],
    noise: NoiseName = None,
    log: Annotated[
        Path | None,
        typer.Option(metavar="LOG", help="The log whose scheduling values the matrices are at, if any is scheduled."),
    ] = None,
    architecture: Architecture = None,
    models: Models = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Write the models of a plant's observers, with their bounds and promises, for a checker that is not of ours.

    Floats are in hexadecimal, so that they are the very numbers that the observers take. Of a scheduled model the
    scheduling value of each sample of the log is an axiom of what is proven.

    \b
    Example:
      svo describe eclipse --models lpv --log flight.csv --out plant.json
    """
    from svo.detection.plant_record import check_replaced, plant_record
    from svo.plant import BankChoice, with_bank
    from svo.store import write_text
    from svo.terminal import json_text

    check_new(out, overwrite)
    check_replaced(out)
    found = with_bank(face.find_plant(plant), BankChoice(architecture, models))
    data = None if log is None else face.read_log(log, found)
    record = plant_record(found, chosen_noise(found, noise), data)
    text = json_text(record) + "\n"
    write_text(out, text)
    digest = sha256(text.encode()).hexdigest()  # which checkers print with their verdict
    if as_json:
        names = list(record["observers"])
        print_json({"file": str(out), "noise": record["noise"], "observers": names, "sha256": digest})
    else:
        say(f"Models of {', '.join(record['observers'])} with their bounds: {out} (sha256 {digest})")
