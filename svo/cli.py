"""The command line. Whatever is slow to import is imported inside the command that needs it."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from svo.cli_output import (
    describe,
    print_checks,
    print_detection,
    print_detector_study,
    print_isolability,
    print_json,
    print_study,
)

if TYPE_CHECKING:
    from svo.alarms import Alarm, AlarmCheck
    from svo.interval.study import LearnsDetectors
    from svo.log import Log
    from svo.plant import MonitoredPlant
    from svo.study.configuration import StudyConfiguration

app = typer.Typer(
    help="Set-membership fault detection and isolation: studies, simulation, detection on logs, proofs of alarms.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

PREPARING = "Preparing compiled code (about a minute the first time, then kept)"

DescribedName = Annotated[
    str, typer.Argument(metavar="PLANT", help="A registered plant, or a TOML file that describes one (my.toml).")
]
LogFile = Annotated[
    Path, typer.Argument(metavar="LOG", help="CSV, Parquet or MAT file with the plant's columns (`svo plants --json`).")
]
PlantName = Annotated[str, typer.Argument(metavar="PLANT", help="A registered plant; `svo plants` lists them.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the figures as JSON on standard output.")]
NoiseName = Annotated[
    str | None, typer.Option(metavar="NAME", help="Noise set: the bounds assumed. [default: the plant's first]")
]
Architecture = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Architecture of the bank, such as I or II. [default: the plant's own]"),
]
FlightSeed = Annotated[int, typer.Option(min=0, help="Seed of the fault-free flight that gives the inputs.")]
FaultSize = Annotated[float, typer.Option(metavar="FRACTION", help="Size of the faults, of those the plant states.")]


@app.command()
def plants(as_json: AsJson = False) -> None:
    """List the plants that are registered.

    \b
    Example:
      svo plants
    """
    with _one_line_errors():
        from svo.plant import load_plant, registered_plants

        every = [load_plant(name) for name in registered_plants()]
        if as_json:
            print_json([describe(plant) for plant in every])
            return
        for plant in every:
            typer.echo(f"{plant.name}: {plant.title}")
            for fault, profiles in plant.faults.items():
                typer.echo(f"    fault {fault}: {', '.join(profiles)}")
            typer.echo(f"    noise sets: {', '.join(plant.noise_sets)}; sampling time {plant.Ts:g} s")


@app.command()
def study(
    plant: PlantName,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the results; new or empty, unless --resume.")],
    runs: Annotated[
        int, typer.Option(min=1, help="Runs of each noise set, fault and profile, and without a fault.")
    ] = 10,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the study; the same seed gives the same runs.")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="Processes. The results do not depend on it.")] = os.cpu_count()
    or 1,
    noise: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Noise set; may be repeated. [default: the plant's first]")
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Fault, or none for fault-free runs; may be repeated. [default: all and none]"
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Run on the dask.distributed cluster of this scheduler instead."),
    ] = None,
    architecture: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Architecture of the bank; several see the same runs. [default: the plant's own]"
        ),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the same study in DIR after an interruption.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Measure times to detect and to isolate over many simulated runs.

    Writes DIR/runs.parquet (a folder of part files), summary.csv, alarms.jsonl, pictures and report.html. A plant with
    interval detectors (elevator) is studied with these, each learnt anew in every run.

    \b
    Example:
      svo study eclipse --runs 10 --seed 0 --workers 2 --noise quiet --out results
      svo study eclipse --runs 10 --architecture I --architecture II --out side_by_side
      svo study elevator --runs 200 --seed 0 --out results
    """
    with _one_line_errors():
        _need_study_extra()
        from svo.interval.study import LearnsDetectors
        from svo.plant import load_plant
        from svo.progress import progress
        from svo.study.configuration import StudyConfiguration
        from svo.study.publish import publish
        from svo.study.runner import run_study, warm_up
        from svo.study.store import StudyFolder

        the_plant = load_plant(plant)
        configuration = StudyConfiguration.for_plant(
            the_plant, runs=runs, seed=seed, noise=noise or (), faults=fault or (), architectures=architecture or ()
        )
        StudyFolder(out).check(configuration, resume)
        if isinstance(the_plant, LearnsDetectors):
            _study_detectors(the_plant, configuration, out, workers, resume, as_json)
            return
        _announce(PREPARING)
        warm_up(the_plant, configuration.noise[0])
        with progress("Runs") as update:
            folder = run_study(
                configuration, out, workers=workers, scheduler=scheduler, resume=resume, progress=update
            )
        _announce("Writing summary, pictures and report")
        summaries = publish(folder, the_plant)
        if as_json:
            from svo.study.summary import to_json

            print_json({"configuration": configuration.to_dict(), "summary": to_json(summaries)})
        else:
            print_study(the_plant, summaries)
            typer.echo(f"Report: {out / 'report.html'}")


@app.command()
def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a study, finished or still running.")],
) -> None:
    """Write summary.csv, pictures and report.html of a study from the runs that it has so far.

    \b
    Example:
      svo report results
    """
    with _one_line_errors():
        _need_study_extra()
        from svo.interval.study import LearnsDetectors
        from svo.interval.study import publish as publish_detectors
        from svo.plant import load_plant
        from svo.study.publish import publish
        from svo.study.store import StudyFolder

        study = StudyFolder(folder)
        the_plant = load_plant(study.identity()["configuration"]["plant"])
        if not any(study.parts.glob("run-*.parquet")):
            raise ValueError(f"{folder} holds no finished run yet; its report needs one")
        if isinstance(the_plant, LearnsDetectors):
            publish_detectors(study, the_plant)
        else:
            publish(study, the_plant)
        typer.echo(f"Report: {folder / 'report.html'}")


@app.command()
def simulate(
    plant: PlantName,
    out: Annotated[Path, typer.Option(metavar="LOG.csv", help="CSV file to write.")],
    fault: Annotated[str, typer.Option(metavar="NAME", help="Fault to simulate, or none.")] = "none",
    profile: Annotated[
        str | None, typer.Option(metavar="NAME", help="Shape of the fault in time. [default: the fault's first]")
    ] = None,
    noise: NoiseName = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed; that of a row of runs.parquet gives that very run.")] = 0,
) -> None:
    """Simulate one run and write its log, true states included.

    \b
    Example:
      svo simulate eclipse --fault elevator --profile step --noise quiet --seed 0 --out log.csv
    """
    with _one_line_errors():
        from svo.log_file import write_log
        from svo.plant import HEALTHY, fault_start, load_plant
        from svo.study.configuration import check_fault, check_noise

        the_plant = load_plant(plant)
        noise = _noise(the_plant, noise)
        check_noise(the_plant, noise)
        if fault == HEALTHY:
            if profile not in (None, HEALTHY):
                raise ValueError(
                    f"profile {profile!r} is given without a fault; name one with --fault, or leave --profile out"
                )
            profile = HEALTHY
        else:
            check_fault(the_plant, fault, profile)
            profile = profile or the_plant.faults[fault][0]
        log = the_plant.simulate(fault, profile, noise, seed)
        write_log(out, log, the_plant.columns)
        start = fault_start(the_plant, fault, profile)
        what = "no fault" if fault == HEALTHY else f"{fault} fault ({profile}) from {start:g} s"
        typer.echo(f"{out}: {len(log)} samples of {the_plant.Ts:g} s, {what}, {noise} noise, seed {seed}")


@app.command()
def detect(
    plant: DescribedName,
    log: LogFile,
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for alarms.jsonl and verdict.json.")] = None,
    noise: NoiseName = None,
    architecture: Architecture = None,
    as_json: AsJson = False,
) -> None:
    """Run a plant's isolation bank over a log, sample by sample, and say what it finds.

    An empty or NaN cell of a sensor is a missing measurement. The exit code is 0 also when a fault is found.

    \b
    Example:
      svo detect eclipse log.csv --out findings
      svo detect my.toml log.mat --out findings
    """
    with _one_line_errors():
        from svo.description import find_plant, keep_description
        from svo.detect import detect as run_detection
        from svo.detect import write_detection
        from svo.log_file import read_log
        from svo.plant import DetectsThresholds, in_architecture
        from svo.progress import progress
        from svo.study.configuration import check_noise

        the_plant = in_architecture(find_plant(plant), architecture)
        noise = _noise(the_plant, noise)
        check_noise(the_plant, noise)
        samples = read_log(log, the_plant.columns, the_plant.Ts)
        _announce(PREPARING)
        with progress("Samples") as update:
            found = run_detection(the_plant, samples, noise, source={"log": log.name}, progress=update)
        crossings = the_plant.detect_thresholds(samples) if isinstance(the_plant, DetectsThresholds) else None
        beside = {} if crossings is None else {"interval_detector": crossings.to_dict()}
        if out is not None:
            write_detection(out, found, beside)
            keep_description(the_plant, out)
        if as_json:
            print_json(found.to_dict() | beside)
            return
        print_detection(found)
        if crossings is not None:
            typer.echo(crossings.to_text())
        if out is not None:
            typer.echo(f"Alarms with certificates: {out / 'alarms.jsonl'}")


@app.command()
def watch(
    plant: DescribedName,
    log: Annotated[str, typer.Argument(metavar="LOG", help="CSV file that is being written, or - for standard input.")],
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder for alarms.jsonl, written as they are raised.")
    ] = None,
    noise: NoiseName = None,
    until_end: Annotated[
        bool, typer.Option("--until-end", help="End where the file ends, instead of waiting for more.")
    ] = False,
) -> None:
    """Show live what a plant's isolation bank says about a log that is still growing.

    Which models are alive, bounds of each state by each of them, and each alarm with its certificate. In a terminal a
    table, elsewhere plain lines. Ctrl-C ends it; standard input ends it too. The exit code is then 0.

    \b
    Example:
      svo watch eclipse log.csv --out findings
      logger | svo watch my.toml -
    """
    with _one_line_errors():
        from functools import partial

        from svo.alarms import append_alarm, write_alarms
        from svo.cli_output import console
        from svo.description import find_plant, keep_description
        from svo.study.configuration import check_noise
        from svo.watch.lines import lines_of
        from svo.watch.session import Session
        from svo.watch.view import view_of
        from svo.watch.watch import watch as run_watch

        the_plant = find_plant(plant)
        noise = _noise(the_plant, noise)
        check_noise(the_plant, noise)
        lines = lines_of(log, until_end)
        session = Session(the_plant, noise, lines.name)
        keep = None
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
            write_alarms(out / "alarms.jsonl", [])
            keep_description(the_plant, out)
            keep = partial(append_alarm, out / "alarms.jsonl")
        _announce(PREPARING)
        session.warm_up()
        run_watch(lines, session, view_of(console(), session), keep=keep)


@app.command()
def verify(
    alarms: Annotated[Path, typer.Argument(metavar="ALARMS", help="An alarms.jsonl of `svo study` or `svo detect`.")],
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
    with _one_line_errors():
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


@app.command()
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
    with _one_line_errors():
        from svo.isolability import isolability
        from svo.plant import load_plant
        from svo.progress import progress
        from svo.study.configuration import check_noise

        the_plant = load_plant(plant)
        noise = _noise(the_plant, noise)
        check_noise(the_plant, noise)
        _announce(PREPARING)
        with progress("Pairs") as update:
            answer = isolability(the_plant, noise, horizon, seed, progress=update, size=size)
        if as_json:
            print_json(answer.to_dict())
        else:
            print_isolability(answer)


@app.command(name="design-input")
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
    out: Annotated[Path | None, typer.Option(metavar="INPUT.csv", help="CSV file of the designed inputs.")] = None,
    as_json: AsJson = False,
) -> None:
    """Design the input of (locally) least energy that isolates a fault for certain within a number of samples.

    The input deviates from that of one simulated flight without a fault, within the plant's limits; what it makes
    certain is checked as by `svo distinguish`. The exit code is 1 if no input was found.

    \b
    Example:
      svo design-input eclipse --fault elevator --size 0.3 --horizon 10 --hold 5 --noise conservative
    """
    with _one_line_errors():
        from svo.plant import load_plant
        from svo.plant_input import plant_input
        from svo.study.configuration import check_noise

        the_plant = load_plant(plant)
        noise = _noise(the_plant, noise)
        check_noise(the_plant, noise)
        _announce(PREPARING)
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
def calibrate(
    plant: DescribedName,
    log: LogFile,
    noise: NoiseName = None,
    as_json: AsJson = False,
) -> None:
    """Find the smallest widening of the nominal model's bounds that explains a log without faults.

    For a healthy log on which `svo detect` finds a fault: it names each bound of a sensor's noise or of a disturbance
    that is too narrow, by how much, and the sample from which on it must be wider.

    \b
    Example:
      svo calibrate eclipse log.csv --noise quiet
    """
    with _one_line_errors():
        from svo.description import find_plant
        from svo.log_calibration import calibrate_log
        from svo.log_file import read_log
        from svo.study.configuration import check_noise

        the_plant = find_plant(plant)
        noise = _noise(the_plant, noise)
        check_noise(the_plant, noise)
        samples = read_log(log, the_plant.columns, the_plant.Ts)
        _announce("Solving elastic programs (a minute for each thousand samples if many bounds are too narrow)")
        found = calibrate_log(the_plant, samples, noise)
        if as_json:
            print_json(found.to_dict())
        else:
            typer.echo(found.to_text())


@app.command()
def compare(
    plant: PlantName,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for comparison.csv, runs.csv and comparison.png.")],
    runs: Annotated[int, typer.Option(min=1, help="Judged runs of each fault, profile and noise.")] = 50,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the comparison; the same seed gives the same runs.")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="Processes. The results do not depend on it.")] = os.cpu_count()
    or 1,
    noise: NoiseName = None,
    rate: Annotated[
        float, typer.Option(min=0.0, max=0.5, help="Share of fault-free runs that may raise an alarm.")
    ] = 0.02,
    healthy_runs: Annotated[
        int | None,
        typer.Option(min=1, help="Fault-free runs to set levels on, and again to judge. [default: 300 and 200]"),
    ] = None,
    distribution: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="bounded or gaussian noise; may be repeated. [default: both]"),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Set detectors side by side: the same runs, the same optimiser, the same false-alarm rate, other seeds to judge.

    Every detector is tuned on training runs, under bounded and under Gaussian noise, and judged on runs of other
    seeds. Prints the median delays; the table has the rest.

    \b
    Example:
      svo compare eclipse --runs 50 --seed 0 --workers 2 --out comparison
      svo compare elevator --noise quiet --runs 20 --healthy-runs 50 --out comparison
    """
    with _one_line_errors():
        from dataclasses import replace

        from svo.comparison.comparison import DISTRIBUTIONS, Comparison, run_comparison
        from svo.comparison.publish import publish_comparison, to_text
        from svo.plant import load_plant
        from svo.progress import progress
        from svo.study.configuration import check_noise

        the_plant = load_plant(plant)
        noise = _noise(the_plant, noise)
        check_noise(the_plant, noise)
        for name in distribution or ():
            if name not in DISTRIBUTIONS:
                raise ValueError(f"distribution is {name!r}; expected one of {', '.join(DISTRIBUTIONS)}")
        chosen = tuple(d for d in DISTRIBUTIONS if d in (distribution or DISTRIBUTIONS))
        comparison = Comparison(plant, noise, runs=runs, seed=seed, rate=rate, distributions=chosen)
        if healthy_runs is not None:
            comparison = replace(comparison, healthy_calibration=healthy_runs, healthy_runs=healthy_runs)
        _announce(PREPARING)
        with progress("Detectors") as update:
            compared = run_comparison(comparison, workers, update)
        rows = publish_comparison(out, compared, the_plant)
        if as_json:
            print_json([row.to_dict() for row in rows])
        else:
            typer.echo(to_text(rows))
            typer.echo(f"Table: {out / 'comparison.csv'}; picture: {out / 'comparison.png'}")


@contextmanager
def _one_line_errors() -> Iterator[None]:
    """What a user can cause becomes one line on standard error and exit code 1."""
    try:
        yield
    except OSError as error:
        _fail(f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error))
    except (ValueError, TypeError, RuntimeError, ImportError) as error:
        _fail(str(error))
    except KeyboardInterrupt:
        _fail("interrupted; the runs of a study that are done are kept, and --resume goes on", code=130)


def _fail(message: str, code: int = 1) -> None:
    typer.echo(f"error: {' '.join(message.split())}", err=True)
    raise typer.Exit(code)


def _study_detectors(
    the_plant: LearnsDetectors, configuration: StudyConfiguration, out: Path, workers: int, resume: bool, as_json: bool
) -> None:
    from svo.interval.study import publish, run_detection_study
    from svo.progress import progress

    with progress("Runs") as update:
        folder = run_detection_study(configuration, out, workers=workers, resume=resume, progress=update)
    _announce("Writing summary, pictures and report")
    found = publish(folder, the_plant)
    if as_json:
        print_json({"configuration": configuration.to_dict(), **found.to_dict()})
        return
    print_detector_study(found)
    typer.echo(f"Report: {out / 'report.html'}")


def _need_study_extra() -> None:
    from importlib.util import find_spec

    if find_spec("pyarrow") is None:
        raise ValueError(
            "svo study needs pyarrow, which is not installed; install the extra: pip install 'svo-fdi[study]'"
        )


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


def _noise(plant: MonitoredPlant, noise: str | None) -> str:
    return plant.noise_sets[0] if noise is None else noise


def _announce(what: str) -> None:
    typer.echo(f"{what} ...", err=True)
