"""Detection on logs."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import svo as face
from svo.cli.destinations import writable_file, writable_folder
from svo.cli.frame import app, chosen_noise, note, one_line_errors
from svo.cli.options import Architecture, AsJson, DescribedName, LogFile, Models, NoiseName, Overwrite, positive
from svo.cli.output import print_json, say

if TYPE_CHECKING:
    from svo.detection.findings import Findings
    from svo.detection.found import Detection
    from svo.detection.report.options import ReportOptions


@app.command()
@one_line_errors()
def detect(
    plant: DescribedName,
    log: LogFile,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            callback=writable_folder,
            help="Folder for alarms.jsonl and verdict.json.",
        ),
    ] = None,
    overwrite: Overwrite = False,
    report: Annotated[
        bool, typer.Option("--report", help="Also write DIR/report.html: verdicts, bounds, readings, proofs.")
    ] = False,
    states: Annotated[
        list[str] | None,
        typer.Option(
            "--states", metavar="NAMES", help="States and outputs in the report, with commas between. [default: all]"
        ),
    ] = None,
    formats: Annotated[
        list[str] | None,
        typer.Option("--format", metavar="NAMES", help="Also write the report's pictures as files: svg,pdf,png."),
    ] = None,
    noise: NoiseName = None,
    architecture: Architecture = None,
    models: Models = None,
    as_json: AsJson = False,
) -> None:
    """Run a plant's isolation bank over a log, sample by sample, and say what it finds.

    An empty or NaN cell of a sensor is a missing measurement. The exit code is 0 also when a fault is found.

    \b
    Example:
      svo detect eclipse log.csv --out findings
      svo detect my.toml log.mat --out findings
      svo detect my.toml log.csv --out findings --report --format svg,pdf
    """
    from svo.cli.progress import busy, progress
    from svo.detection.alarm_folder import check_no_results
    from svo.detection.streamed import detect_streamed
    from svo.plant.description import check_kept_description
    from svo.plant.long_log import survey_log

    if out is not None:
        check_no_results(out, overwrite)
    wanted = _wanted_report(report, out, states, formats)
    the_plant = face.find_plant(plant, architecture=architecture, models=models)
    if out is not None and not overwrite:
        check_kept_description(the_plant, out)
    noise = chosen_noise(the_plant, noise)
    shown: Detection | None = None
    if wanted is None:
        with busy("Reading"):
            samples = survey_log(log, the_plant)
        with progress("Samples") as update:
            found: Findings = detect_streamed(the_plant, samples, noise, progress=update)
    else:  # which shows every sample
        wanted.check(the_plant, noise)
        with busy("Reading"):
            data = face.read_log(log, the_plant)
        with progress("Samples") as update:
            found = shown = face.detect(the_plant, data, noise, progress=update)
    if out is not None:
        found.save(out, overwrite=overwrite)
        if wanted is not None and shown is not None:
            chosen = {"--noise": noise, "--architecture": architecture, "--models": models}
            words = [word for option, value in chosen.items() if value for word in (option, value)]
            with busy("Bounds and pictures"):
                wanted.write(out, shown, log, ["svo", "detect", plant, str(log), *words])
    if as_json:
        print_json(found.to_dict())
        return
    typer.echo(str(found))
    if out is not None:
        what = f"Alarms with certificates: {out / 'alarms.jsonl'}; verdict" if found.alarms else "Verdict"
        say(f"{what}: {out / 'verdict.json'}")
        if report:
            say(f"Report: {out / 'report.html'}")


def _wanted_report(
    wanted: bool, out: Path | None, states: list[str] | None, formats: list[str] | None
) -> ReportOptions | None:
    """What the report is to show; None if there is to be none."""
    if not wanted:
        for name, given in (("--states", states), ("--format", formats)):
            if given:
                raise ValueError(f"{name} was given without --report, which it is about")
        return None
    if out is None:
        raise ValueError("--report was given without a place for it; expected --out DIR")
    from svo.detection.report.options import ReportOptions

    return ReportOptions.of(states or (), formats or ())


@app.command()
@one_line_errors()
def watch(
    plant: DescribedName,
    log: Annotated[str, typer.Argument(metavar="LOG", help="CSV file that is being written, or - for standard input.")],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            callback=writable_folder,
            help="Folder for alarms.jsonl, written as they are raised; those of the same watch before are kept.",
        ),
    ] = None,
    overwrite: Overwrite = False,
    noise: NoiseName = None,
    models: Models = None,
    until_end: Annotated[
        bool, typer.Option("--until-end", help="End where the file ends, instead of waiting for more.")
    ] = False,
    silence: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", callback=positive, help="Say so when nothing has come for so long."),
    ] = None,
    state: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Keep the state there, and go on from it when the watch is started again."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what happens as JSON, an object a line.")] = False,
) -> None:
    """Show live what a plant's isolation bank says about a log that is still growing.

    Which models are alive, bounds of each state by each of them, and each alarm with its certificate. In a terminal a
    table, elsewhere plain lines. The log is followed by its name through rotation, truncation and replacement; lines
    that cannot be read are counted and reported. It ends at Ctrl-C or SIGTERM, or when standard input ends. The exit
    code is then 0.

    \b
    Example:
      svo watch eclipse log.csv --out findings --state watch.state --silence 5
      logger | svo watch my.toml -
    """
    with ExitStack() as stack:
        from functools import partial

        from svo.cli.output import console
        from svo.detection.alarm_folder import watch_folder
        from svo.detection.watch.follow import lines_of
        from svo.detection.watch.json_view import JsonView
        from svo.detection.watch.session import Session, identity_of
        from svo.detection.watch.silence import Silence
        from svo.detection.watch.state import check_replaced, resume_state, save_state
        from svo.detection.watch.view import view_of
        from svo.detection.watch.watch import watch as run_watch
        from svo.plant.description import check_kept_description, keep_description

        the_plant = face.find_plant(plant, models=models)
        noise = chosen_noise(the_plant, noise)
        lines = lines_of(log, until_end)
        session = Session(the_plant, noise, lines.name)
        identity = identity_of(the_plant, noise, log)
        keep = save = None
        if state is not None and writable_file(state) and state.exists() and overwrite:
            check_replaced(state)
        if out is not None:
            if not overwrite:
                check_kept_description(the_plant, out)
            alarms = stack.enter_context(watch_folder(out, identity, overwrite))
            keep_description(the_plant, out, overwrite)
            for text in alarms.notes:
                note(text)
            if alarms.before:
                note(f"{alarms.alarms} keeps its {alarms.before} alarms of before")
            keep = alarms.add
        if state is not None:
            if state.exists() and not overwrite:
                resume_state(state, session, lines, identity)
            save = partial(save_state, state, session, lines, identity)
        session.warm_up()
        quiet = None if silence is None else Silence(silence)
        view = JsonView(sys.stdout, session) if as_json else view_of(console(), session)
        run_watch(lines, session, view, keep=keep, save=save, silence=quiet)


@app.command()
@one_line_errors()
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
    from svo.cli.progress import busy
    from svo.detection.log_calibration import calibrate_log

    the_plant = face.find_plant(plant)
    noise = chosen_noise(the_plant, noise)
    samples = face.read_log(log, the_plant)
    with busy("Solving elastic programs (a minute for each thousand samples if many bounds are too narrow)"):
        found = calibrate_log(the_plant, samples, noise)
    if as_json:
        print_json(found.to_dict())
    else:
        typer.echo(found.to_text())
