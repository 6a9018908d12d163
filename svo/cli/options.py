"""Arguments and options that several commands take."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Annotated

import typer


def finite(value: float) -> float:
    """A number that is neither NaN nor infinite."""
    if not math.isfinite(value):
        raise typer.BadParameter(f"{value} is not a finite number.")
    return value


def own_processes(limit: float | None, scheduler: str | None, otherwise: float) -> float | None:
    """A limit of time, with which work here is done in processes of its own; a cluster has none unless it is asked."""
    return limit if limit is not None or scheduler is not None else otherwise


def positive(value: float | None) -> float | None:
    """A finite number > 0, or none."""
    if value is not None and not (math.isfinite(value) and value > 0):
        raise typer.BadParameter(f"{value} is not a finite number > 0.")
    return value


def picture_formats(value: str) -> str:
    """Formats of pictures, separated by commas."""
    names = [name.strip().lower() for name in value.split(",") if name.strip()]
    for name in names:
        if name not in ("png", "svg", "pdf"):
            raise typer.BadParameter(f"{name!r} is no format of pictures; expected any of png, svg, pdf: svg,pdf.")
    return ",".join(names or ["png"])


DescribedName = Annotated[
    str, typer.Argument(metavar="PLANT", help="A registered plant, or a TOML file that describes one (my.toml).")
]
LogFile = Annotated[
    Path, typer.Argument(metavar="LOG", help="CSV, Parquet or MAT file with the plant's columns, or as its [log] says.")
]
PlantName = Annotated[str, typer.Argument(metavar="PLANT", help="A registered plant; `svo plants` lists them.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the figures as JSON on standard output.")]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace what this command wrote there before. [default: an error]")
]
Formats = Annotated[
    str,
    typer.Option(
        "--format", metavar="LIST", callback=picture_formats, help="Formats of pictures besides PNG: svg,pdf or one."
    ),
]
CORES = os.cpu_count() or 1
Workers = Annotated[int, typer.Option(min=1, help="Processes. The results do not depend on it.")]
Scheduler = Annotated[
    str | None,
    typer.Option(metavar="ADDRESS", help="Run on the dask.distributed cluster of this scheduler instead."),
]
Limit = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS", callback=positive, help="Stop what takes longer: it has failed, and the rest goes on."
    ),
]
RetryFailed = Annotated[bool, typer.Option("--retry-failed", help="With --resume: try again what failed.")]
NoiseName = Annotated[
    str | None, typer.Option(metavar="NAME", help="Noise set: the bounds assumed. [default: the plant's first]")
]
Architecture = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Architecture of the bank, such as I or II. [default: the plant's own]"),
]
Models = Annotated[
    str | None,
    typer.Option(metavar="KIND", help="Kind of the observers' models, such as lpv. [default: the plant's own]"),
]
FlightSeed = Annotated[int, typer.Option(min=0, help="Seed of the fault-free flight that gives the inputs.")]
FaultSize = Annotated[
    float,
    typer.Option(metavar="FRACTION", callback=finite, help="Size of the faults, of those the plant states."),
]
