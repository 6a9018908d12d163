"""Recorded logs of other dialects."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import svo as face
from svo.cli.destinations import check_new, writable_parquet
from svo.cli.frame import app, one_line_errors
from svo.cli.options import AsJson, Overwrite
from svo.cli.output import print_json


@app.command("import")
@one_line_errors()
def import_(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A log as it is: a file, or a folder of them.")],
    toml: Annotated[
        Path | None,
        typer.Option(metavar="my.toml", help="Description of the plant; its [log] says how the log is written."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="LOG.parquet", callback=writable_parquet, help="Plain log to write."),
    ] = None,
    overwrite: Overwrite = False,
    guess: Annotated[
        bool, typer.Option("--guess", help="Read nothing: propose a [log] table for this log, to be checked by you.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Read a recorded log as the [log] table of a description states it, and write it as a plain one.

    It says what was read: samples, span, what is missing and the range of each channel in the model's units. The file
    keeps the SHA-256 of the source and the table. With --guess a [log] table is printed instead, as TOML, with comments
    where the file leaves something open; no data is ever read by a guess.

    \b
    Example:
      svo import recording.csv --guess --toml my.toml
      svo import recording.csv --toml my.toml --out log.parquet
    """
    if guess:
        from svo.logs.dialect.guess import guessed_table

        if out is not None:
            raise ValueError("--out and --guess were both given; a guess reads no data, so leave --out out")
        plant = None if toml is None else face.find_plant(toml)
        known = () if plant is None else (plant.columns, plant.Ts)
        typer.echo(guessed_table(log, *known), nl=False)
        return
    if toml is None or out is None:
        raise ValueError(
            "expected --toml my.toml, whose [log] says how the log is written, and --out LOG.parquet; or --guess, "
            "which proposes such a table"
        )
    from svo.cli.progress import busy
    from svo.plant.imported import import_log

    if not (out.exists() and log.exists() and out.samefile(log)):  # which is refused in any case
        check_new(out, overwrite)
    with busy("Reading"):
        found = import_log(log, face.find_plant(toml), out)
    if as_json:
        print_json(found.to_dict())
    else:
        typer.echo(str(found))
