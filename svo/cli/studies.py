"""Plants, and studies of simulated runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from svo.cli.destinations import check_new, writable_folder, writable_log
from svo.cli.frame import (
    KEPT,
    app,
    chosen_noise,
    note,
    one_line_errors,
    plant_to_simulate,
    tell_failures,
)
from svo.cli.options import (
    CORES,
    AsJson,
    Formats,
    Limit,
    NoiseName,
    Overwrite,
    PlantName,
    RetryFailed,
    Scheduler,
    Workers,
    own_processes,
)
from svo.cli.output import describe, print_detector_study, print_json, print_study

_LIMIT = 3600.0  # s that a run may take, unless it is asked for


@app.command()
@one_line_errors()
def plants(as_json: AsJson = False) -> None:
    """List the plants that are registered.

    \b
    Example:
      svo plants
    """
    from svo.plant import registered_plants
    from svo.plant.registry import made_by

    every = []
    for name, loader in registered_plants().items():
        try:
            every.append(made_by(loader, name))
        except (ImportError, TypeError) as error:  # one that is broken hides no other
            typer.echo(f"note: {error}", err=True)
    if as_json:
        print_json([describe(plant) for plant in every])
        return
    for plant in every:
        typer.echo(f"{plant.name}: {plant.title}")
        for fault, profiles in plant.faults.items():
            typer.echo(f"    fault {fault}: {', '.join(profiles)}")
        typer.echo(f"    noise sets: {', '.join(plant.noise_sets)}; sampling time {plant.Ts:g} s")


@app.command()
@one_line_errors(KEPT)
def study(
    plant: PlantName,
    out: Annotated[
        Path,
        typer.Option(metavar="DIR", callback=writable_folder, help="Folder of the results; new or empty."),
    ],
    runs: Annotated[
        int, typer.Option(min=1, help="Runs of each noise set, fault and profile, and without a fault.")
    ] = 10,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the study; the same seed gives the same runs.")] = 0,
    workers: Workers = CORES,
    noise: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Noise set; may be repeated. [default: the plant's first]")
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Fault, or none for fault-free runs; may be repeated. [default: all and none]"
        ),
    ] = None,
    scheduler: Scheduler = None,
    limit: Limit = None,
    architecture: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Architecture of the bank; several see the same runs. [default: the plant's own]"
        ),
    ] = None,
    models: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND", help="Kind of the observers' models; several see the same runs. [default: the plant's own]"
        ),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the same study in DIR after an interruption.")
    ] = False,
    overwrite: Overwrite = False,
    retry_failed: RetryFailed = False,
    formats: Formats = "png",
    as_json: AsJson = False,
) -> None:
    """Measure times to detect and to isolate over many simulated runs.

    Writes DIR/runs.parquet (a folder of part files), summary.csv, alarms.jsonl.gz, pictures and report.html. A plant
    with interval detectors (elevator) is studied with these, each learnt anew in every run. A run that fails is a row
    with its error; the study goes on, and the exit code is 1.

    \b
    Example:
      svo study eclipse --runs 10 --seed 0 --noise quiet --out results
      svo study eclipse --runs 10 --architecture I --architecture II --out both
      svo study elevator --runs 200 --seed 0 --out results
    """
    from svo.checks import optional_import

    optional_import("pyarrow", "study", "studies")  # first: what is imported next needs the extra too
    from svo.cli.progress import busy, progress
    from svo.plant.description.find import check_kept_description, keep_description
    from svo.studies.added import added_study
    from svo.studies.configuration import StudyConfiguration
    from svo.studies.isolation.runner import run_study
    from svo.studies.isolation.store import StudyFolder
    from svo.studies.runs import all_failures
    from svo.studies.thresholds import LearnsDetectors, run_detection_study

    the_plant = plant_to_simulate(plant)
    configuration = StudyConfiguration.for_plant(
        the_plant, runs=runs, seed=seed, noise=noise or (), faults=fault or (), architectures=architecture or (),
        models=models or (),
    )  # fmt: skip
    if overwrite:
        added = added_study(the_plant, configuration)
        StudyFolder(out).clear(resume, () if added is None else (added.name,))
    for line in StudyFolder(out).check(configuration, resume):
        note(line)
    learns = isinstance(the_plant, LearnsDetectors)
    run, show = (run_detection_study, _detector_study) if learns else (run_study, _isolation_study)
    place: dict[str, Any] = {
        "workers": workers,
        "scheduler": scheduler,
        "limit": own_processes(limit, scheduler, _LIMIT),
    }
    check_kept_description(the_plant, out)
    with progress("Runs") as update:
        folder = run(configuration, out, resume=resume, retry_failed=retry_failed, progress=update, **place)
    with busy("Writing summary, pictures and report"):
        show(folder, the_plant, formats.split(","), {"configuration": configuration.to_dict()} if as_json else None)
    keep_description(the_plant, out)
    if not as_json:
        typer.echo(f"Report: {out / 'report.html'}")
    tell_failures(all_failures(folder, the_plant), "runs")


@app.command()
@one_line_errors()
def report(
    folder: Annotated[
        Path,
        typer.Argument(metavar="DIR", callback=writable_folder, help="Folder of a study, finished or still running."),
    ],
    without_damaged: Annotated[
        bool, typer.Option("--without-damaged", help="Leave out parts of the study that are damaged, and name them.")
    ] = False,
    formats: Formats = "png",
) -> None:
    """Write summary.csv, pictures and report.html of a study from the runs that it has so far.

    A part of the study that is damaged is an error that names it, unless --without-damaged leaves it out.

    \b
    Example:
      svo report results
    """
    from svo.checks import optional_import

    optional_import("pyarrow", "study", "studies")  # first: what is imported next needs the extra too
    from svo.cli.progress import busy
    from svo.studies.isolation.publish import publish
    from svo.studies.isolation.store import StudyFolder
    from svo.studies.thresholds import LearnsDetectors
    from svo.studies.thresholds import publish as publish_detectors

    study = StudyFolder(folder)
    the_plant = plant_to_simulate(study.identity()["configuration"]["plant"])
    with busy("Writing summary, pictures and report"):
        if isinstance(the_plant, LearnsDetectors):
            publish_detectors(study, the_plant, without_damaged, formats.split(","))
        else:
            publish(study, the_plant, without_damaged, formats.split(","))
    for line in study.notes():
        note(line)
    typer.echo(f"Report: {folder / 'report.html'}")


@app.command()
@one_line_errors()
def simulate(
    plant: PlantName,
    out: Annotated[
        Path, typer.Option(metavar="LOG.csv", callback=writable_log, help="CSV, Parquet or MAT file to write.")
    ],
    overwrite: Overwrite = False,
    fault: Annotated[str, typer.Option(metavar="NAME", help="Fault to simulate, or none.")] = "none",
    profile: Annotated[
        str | None, typer.Option(metavar="NAME", help="Shape of the fault in time. [default: the fault's first]")
    ] = None,
    noise: NoiseName = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed; that of a row of runs.parquet gives that very run.")] = 0,
    as_json: AsJson = False,
) -> None:
    """Simulate one run and write its log, true states included.

    \b
    Example:
      svo simulate eclipse --fault elevator --profile step --out log.csv
    """
    from svo.cli.progress import busy
    from svo.logs.file import write_log
    from svo.plant import HEALTHY, fault_start
    from svo.studies.configuration import check_fault

    check_new(out, overwrite)
    the_plant = plant_to_simulate(plant)
    noise = chosen_noise(the_plant, noise)
    if fault == HEALTHY:
        if profile not in (None, HEALTHY):
            raise ValueError(
                f"profile {profile!r} is given without a fault; name one with --fault, or leave --profile out"
            )
        profile = HEALTHY
    else:
        check_fault(the_plant, fault, profile)
        profile = profile or the_plant.faults[fault][0]
    with busy("Simulating"):
        log = the_plant.simulate(fault, profile, noise, seed)
    write_log(out, log, the_plant.columns)
    start = fault_start(the_plant, fault, profile)
    if as_json:
        told = {"log": str(out), "samples": len(log), "Ts": the_plant.Ts, "plant": the_plant.name, "fault": fault}
        print_json(
            {
                **told,
                "profile": profile,
                "fault_time_s": None if fault == HEALTHY else start,
                "noise": noise,
                "seed": seed,
            }
        )
        return
    what = "no fault" if fault == HEALTHY else f"{fault} fault ({profile}) from {start:g} s"
    typer.echo(f"{out}: {len(log)} samples of {the_plant.Ts:g} s, {what}, {noise} noise, seed {seed}")


def _isolation_study(folder: Any, plant: Any, formats: Sequence[str], json: dict[str, Any] | None) -> None:
    from svo.studies.isolation.publish import publish
    from svo.studies.isolation.summary import to_json

    summaries = publish(folder, plant, formats=formats)
    if json is None:
        print_study(plant, summaries)
    else:
        print_json({**json, "summary": to_json(summaries)})


def _detector_study(folder: Any, plant: Any, formats: Sequence[str], json: dict[str, Any] | None) -> None:
    from svo.studies.thresholds import publish

    found = publish(folder, plant, formats=formats)
    if json is None:
        print_detector_study(found)
    else:
        print_json({**json, **found.to_dict()})
