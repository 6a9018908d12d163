"""What can be told apart, with which inputs, and by which detector."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from svo.cli.destinations import check_new, writable_csv, writable_folder
from svo.cli.frame import (
    KEPT,
    app,
    chosen_noise,
    one_line_errors,
    plant_to_simulate,
    tell_failures,
)
from svo.cli.options import (
    CORES,
    AsJson,
    FaultSize,
    FlightSeed,
    Formats,
    Limit,
    NoiseName,
    Overwrite,
    PlantName,
    RetryFailed,
    Scheduler,
    Workers,
    finite,
    own_processes,
)
from svo.cli.output import print_isolability, print_json


@app.command()
@one_line_errors()
def distinguish(
    plant: PlantName,
    horizon: Annotated[int, typer.Option(min=1, help="Largest number of samples after the fault to search.")] = 100,
    noise: NoiseName = None,
    seed: FlightSeed = 0,
    size: FaultSize = 1.0,
    as_json: AsJson = False,
) -> None:
    """Tell, without a study, which faults a plant's observers cannot mistake, and after how many samples.

    Each fault, at a stated size, is compared with each observer's model along one simulated flight without a fault:
    its inputs and schedule are kept, all disturbances, noises and uncertainties are free within their bounds. The
    number is that of the samples, the first faulty one included, after which an observer that keeps all data is
    falsified for certain; by luck it may be sooner.

    \b
    Example:
      svo distinguish eclipse --horizon 50 --noise quiet
    """
    from svo.analysis.isolability import isolability
    from svo.cli.progress import progress

    the_plant = plant_to_simulate(plant)
    noise = chosen_noise(the_plant, noise)
    with progress("Pairs") as update:
        answer = isolability(the_plant, noise, horizon, seed, progress=update, size=size)
    if as_json:
        print_json(answer.to_dict())
    else:
        print_isolability(answer)


@app.command(name="design-input")
@one_line_errors()
def design_input(
    plant: PlantName,
    fault: Annotated[str, typer.Option(metavar="NAME", help="Fault to isolate.")],
    horizon: Annotated[
        int, typer.Option(min=1, help="Samples after the fault within which all other observers are falsified.")
    ],
    hold: Annotated[int, typer.Option(min=1, help="Samples over which the deviation is constant.")] = 1,
    only: Annotated[
        list[str] | None,
        typer.Option("--input", metavar="COLUMN", help="Input that may deviate; may be repeated. [default: all]"),
    ] = None,
    noise: NoiseName = None,
    seed: FlightSeed = 0,
    size: FaultSize = 1.0,
    out: Annotated[
        Path | None, typer.Option(metavar="INPUT.csv", callback=writable_csv, help="CSV file of the designed inputs.")
    ] = None,
    overwrite: Overwrite = False,
    as_json: AsJson = False,
) -> None:
    """Design the input of (locally) least energy that isolates a fault for certain within a number of samples.

    The input deviates from that of one simulated flight without a fault, within the plant's limits; what it makes
    certain is checked as by `svo distinguish`. The exit code is 1 if no input was found.

    \b
    Example:
      svo design-input eclipse --fault elevator --size 0.3 --horizon 10
    """
    from svo.analysis.plant_input import plant_input
    from svo.cli.progress import busy

    check_new(out, overwrite)
    the_plant = plant_to_simulate(plant)
    noise = chosen_noise(the_plant, noise)
    with busy("Designing an input"):
        found = plant_input(the_plant, noise, fault, horizon, inputs=only or (), hold=hold, size=size, seed=seed)
    if as_json:
        print_json(found.to_dict())
    else:
        typer.echo(found.to_text())
    if found.design.u is not None and out is not None:
        found.write(out)
    if found.design.u is None:
        raise typer.Exit(1)


@app.command()
@one_line_errors(KEPT)
def compare(
    plant: PlantName,
    out: Annotated[
        Path,
        typer.Option(
            metavar="DIR", callback=writable_folder, help="Folder for comparison.csv, runs.csv and comparison.png."
        ),
    ],
    runs: Annotated[int, typer.Option(min=1, help="Judged runs of each fault, profile and noise.")] = 50,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the comparison; the same seed gives the same runs.")] = 0,
    workers: Workers = CORES,
    noise: NoiseName = None,
    rate: Annotated[
        float,
        typer.Option(min=0.0, max=0.5, callback=finite, help="Share of fault-free runs that may raise an alarm."),
    ] = 0.02,
    healthy_runs: Annotated[
        int | None,
        typer.Option(min=1, help="Fault-free runs to set levels on, and again to judge. [default: 300 and 200]"),
    ] = None,
    distribution: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="bounded or gaussian noise; may be repeated. [default: both]"),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the same comparison in DIR after an interruption.")
    ] = False,
    overwrite: Overwrite = False,
    retry_failed: RetryFailed = False,
    scheduler: Scheduler = None,
    limit: Limit = None,
    formats: Formats = "png",
    as_json: AsJson = False,
) -> None:
    """Set detectors side by side: the same runs, the same optimiser, the same false-alarm rate, other seeds to judge.

    Every detector is tuned on training runs, under bounded and under Gaussian noise, and judged on runs of other
    seeds. Prints the median delays; the table has the rest. What fails is a row with its error; the comparison goes on,
    and the exit code is 1.

    \b
    Example:
      svo compare eclipse --runs 50 --seed 0 --workers 2 --out comparison
      svo compare elevator --runs 20 --healthy-runs 50 --out comparison
    """
    from dataclasses import replace

    from svo.checks import expect_one_of
    from svo.cli.progress import progress
    from svo.studies.comparison.comparison import DISTRIBUTIONS, Comparison, run_comparison
    from svo.studies.comparison.publish import publish_comparison, to_text
    from svo.studies.comparison.store import clear_comparison

    the_plant = plant_to_simulate(plant)
    noise = chosen_noise(the_plant, noise)
    for name in distribution or ():
        expect_one_of("distribution", name, DISTRIBUTIONS)
    chosen = tuple(d for d in DISTRIBUTIONS if d in (distribution or DISTRIBUTIONS))
    comparison = Comparison(plant, noise, runs=runs, seed=seed, rate=rate, distributions=chosen)
    if healthy_runs is not None:
        comparison = replace(comparison, healthy_calibration=healthy_runs, healthy_runs=healthy_runs)
    if overwrite:
        clear_comparison(out, resume)
    with progress("Parts") as update:
        compared = run_comparison(
            comparison,
            workers,
            update,
            out=out,
            scheduler=scheduler,
            limit=own_processes(limit, scheduler, math.inf),
            resume=resume,
            retry_failed=retry_failed,
        )
    rows = publish_comparison(out, compared, the_plant, formats.split(","))
    if as_json:
        print_json([row.to_dict() for row in rows])
    else:
        typer.echo(to_text(rows))
        typer.echo(f"Table: {out / 'comparison.csv'}; picture: {out / 'comparison.png'}")
    failed = compared.failures()
    tell_failures(failed, "runs of detectors")
