"""The command line. Whatever is slow to import is imported inside the command that needs it."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from svo.alarms import Alarm, AlarmCheck
    from svo.detect import Detection
    from svo.isolability import Isolability
    from svo.log import Log
    from svo.plant import Plant
    from svo.study.summary import ConditionSummary

app = typer.Typer(
    help="Set-membership fault detection and isolation: studies, simulation, detection on logs, proofs of alarms.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

PREPARING = "Preparing compiled code (about a minute the first time, then kept)"

PlantName = Annotated[str, typer.Argument(metavar="PLANT", help="A registered plant; `svo plants` lists them.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the figures as JSON on standard output.")]
NoiseName = Annotated[
    str | None, typer.Option(metavar="NAME", help="Noise set: the bounds assumed. [default: the plant's first]")
]


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
            _print_json([_describe(plant) for plant in every])
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
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the same study in DIR after an interruption.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Measure times to detect and to isolate over many simulated runs.

    Writes DIR/runs.parquet (a folder of part files), summary.csv, alarms.jsonl, pictures and report.html.

    \b
    Example:
      svo study eclipse --runs 10 --seed 0 --workers 2 --noise quiet --out results
    """
    with _one_line_errors():
        _need_study_extra()
        from svo.plant import load_plant
        from svo.progress import progress
        from svo.study.configuration import StudyConfiguration
        from svo.study.publish import publish
        from svo.study.runner import run_study, warm_up
        from svo.study.store import StudyFolder

        the_plant = load_plant(plant)
        configuration = StudyConfiguration.for_plant(
            the_plant, runs=runs, seed=seed, noise=noise or (), faults=fault or ()
        )
        StudyFolder(out).check(configuration, resume)
        _announce(PREPARING)
        warm_up(the_plant, configuration.noise[0])
        with progress("Runs") as update:
            folder = run_study(configuration, out, workers=workers, resume=resume, progress=update)
        _announce("Writing summary, pictures and report")
        summaries = publish(folder, the_plant)
        if as_json:
            from svo.study.summary import to_json

            _print_json({"configuration": configuration.to_dict(), "summary": to_json(summaries)})
        else:
            _print_study(the_plant, summaries)
            typer.echo(f"Report: {out / 'report.html'}")


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
        from svo.plant import HEALTHY, load_plant
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
        what = "no fault" if fault == HEALTHY else f"{fault} fault ({profile}) from {the_plant.fault_time:g} s"
        typer.echo(f"{out}: {len(log)} samples of {the_plant.Ts:g} s, {what}, {noise} noise, seed {seed}")


@app.command()
def detect(
    plant: PlantName,
    log: Annotated[
        Path, typer.Argument(metavar="LOG", help="CSV file with the plant's columns; see `svo plants --json`.")
    ],
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder for alarms.jsonl and verdict.json.")] = None,
    noise: NoiseName = None,
    as_json: AsJson = False,
) -> None:
    """Run a plant's isolation bank over a log, sample by sample, and say what it finds.

    An empty or NaN cell of a sensor is a missing measurement. The exit code is 0 also when a fault is found.

    \b
    Example:
      svo detect eclipse log.csv --out findings
    """
    with _one_line_errors():
        from svo.detect import detect as run_detection
        from svo.detect import write_detection
        from svo.log_file import read_log
        from svo.plant import load_plant
        from svo.progress import progress
        from svo.study.configuration import check_noise

        the_plant = load_plant(plant)
        noise = _noise(the_plant, noise)
        check_noise(the_plant, noise)
        samples = read_log(log, the_plant.columns, the_plant.Ts)
        _announce(PREPARING)
        with progress("Samples") as update:
            found = run_detection(the_plant, samples, noise, source={"log": log.name}, progress=update)
        if out is not None:
            write_detection(out, found)
        if as_json:
            _print_json(found.to_dict())
            return
        _print_detection(found)
        if out is not None:
            typer.echo(f"Alarms with certificates: {out / 'alarms.jsonl'}")


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
            _print_json(
                [
                    {"line": c.line, "observer": c.observer, "sample": c.sample, "ok": c.ok, "reason": c.reason}
                    for c in checks
                ]
            )
        else:
            _print_checks(alarms, checks)
    if not all(check.ok for check in checks):
        raise typer.Exit(1)


@app.command()
def distinguish(
    plant: PlantName,
    horizon: Annotated[int, typer.Option(min=1, help="Largest number of samples after the fault to search.")] = 100,
    noise: NoiseName = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the fault-free flight that gives the inputs.")] = 0,
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
            answer = isolability(the_plant, noise, horizon, seed, progress=update)
        if as_json:
            _print_json(answer.to_dict())
        else:
            _print_isolability(answer)


@app.command()
def calibrate(
    plant: PlantName,
    log: Annotated[Path, typer.Argument(metavar="LOG", help="CSV file of a flight without faults.")],
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
        from svo.log_calibration import calibrate_log
        from svo.log_file import read_log
        from svo.plant import load_plant
        from svo.study.configuration import check_noise

        the_plant = load_plant(plant)
        noise = _noise(the_plant, noise)
        check_noise(the_plant, noise)
        samples = read_log(log, the_plant.columns, the_plant.Ts)
        _announce("Solving elastic programs (a minute for each thousand samples if many bounds are too narrow)")
        found = calibrate_log(the_plant, samples, noise)
        if as_json:
            _print_json(found.to_dict())
        else:
            typer.echo(found.to_text())


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
    from svo.plant import load_plant
    from svo.verification import verify_chains

    data = _log_of(path, alarms, full)
    return [] if data is None else verify_chains(path, data, load_plant(str(alarms[0].source["plant"])))


def _log_of(path: Path, alarms: Sequence[Alarm], log: Path) -> Log | None:
    """The log to compare alarms with, read by the columns of their plant; None if there are no alarms."""
    from svo.log_file import read_log
    from svo.plant import load_plant

    if not alarms:
        return None
    if any(alarm.source != alarms[0].source for alarm in alarms):
        raise ValueError(
            f"{path} has alarms of several runs, and a log is that of one; give the alarms of that run alone"
        )
    plant = load_plant(str(alarms[0].source.get("plant")))
    return read_log(log, plant.columns, plant.Ts)


def _noise(plant: Plant, noise: str | None) -> str:
    return plant.noise_sets[0] if noise is None else noise


def _describe(plant: Plant) -> dict[str, Any]:
    columns = plant.columns
    return {
        "name": plant.name,
        "title": plant.title,
        "Ts": plant.Ts,
        "fault_time": plant.fault_time,
        "faults": {fault: list(profiles) for fault, profiles in plant.faults.items()},
        "noise_sets": list(plant.noise_sets),
        "columns": {
            "time": columns.time,
            **{
                group: [{"name": c.name, "unit": c.unit} for c in getattr(columns, group)]
                for group in ("inputs", "outputs", "states")
            },
        },
    }


def _console() -> Console:
    from rich.console import Console

    console = Console(highlight=False)
    # A file has no width: a table in it need not be cut off.
    return console if console.is_terminal else Console(highlight=False, width=130)


def _announce(what: str) -> None:
    typer.echo(f"{what} ...", err=True)


def _print_json(value: Any) -> None:
    typer.echo(json.dumps(value, indent=2))


def _print_study(plant: Plant, summaries: Sequence[ConditionSummary]) -> None:
    from svo.study import tables

    console = _console()
    for noise in dict.fromkeys(s.noise for s in summaries):
        chosen = [s for s in summaries if s.noise == noise]
        console.print(tables.to_rich(tables.delay_table(plant, chosen)))
        for line in [*tables.counts(chosen), *tables.not_isolated(chosen), tables.cost(chosen)]:
            typer.echo(f"{line[0].upper()}{line[1:]}.")
        typer.echo("")
    if plant.reference:
        typer.echo(f"Paper: {plant.reference_title}; a dash where it says nothing.")


def _print_detection(found: Detection) -> None:
    if found.detected_s is None:
        typer.echo(f"No fault: the nominal model explains all {len(found.time)} samples ({found.noise} noise).")
    else:
        typer.echo(f"Fault detected at {found.detected_s:g} s: the nominal model is falsified ({found.noise} noise).")
        if found.isolated_s is not None:
            typer.echo(f"Fault isolated at {found.isolated_s:g} s: {found.record.fault}.")
        elif found.alive:
            typer.echo("Not isolated: more than one model explains the data.")
    for alarm in found.alarms:
        typer.echo(f"    {alarm.observer}: falsified at {alarm.time:g} s")
    for name in found.alive:
        typer.echo(f"    {name}: explains the data to the end")
    if not found.alive:
        typer.echo(f"No model explains the data from {max(alarm.time for alarm in found.alarms):g} s on.")
    undecided = int(found.record.undecided.sum())
    if undecided:
        typer.echo(f"    undecided answers: {undecided}")


def _print_isolability(answer: Isolability) -> None:
    from rich.table import Table

    table = Table(title=f"Samples until an observer is surely falsified ({answer.noise} noise)")
    table.add_column("plant with fault")
    observers = list(next(iter(answer.answers.values())))
    for name in observers:
        table.add_column(f"observer {name}")
    for fault, description in answer.faults.items():
        table.add_row(f"{fault}: {description}", *(answer.cell(fault, name) for name in observers))
    _console().print(table)
    typer.echo(
        f"Inputs and schedule: the fault-free flight of seed {answer.seed}, from {answer.fault_time:g} s on. "
        "The first faulty sample counts as 1; an observer with a short window may need more."
    )


def _print_checks(path: Path, checks: Sequence[AlarmCheck]) -> None:
    failed = [check for check in checks if not check.ok]
    for check in failed:
        whose = f" ({check.observer}, sample {check.sample})" if check.sample >= 0 else ""
        typer.echo(f"{path}, line {check.line}{whose}: {check.reason}", err=True)
    seconds = sum(check.seconds for check in checks)
    typer.echo(
        f"{path}: {len(checks) - len(failed)} of {len(checks)} alarms proven in exact arithmetic, in {seconds:.2f} s"
    )
