"""From a finished study's folder to what people read: summary.csv, pictures and report.html."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from svo.pages.page import own_file
from svo.plant import Plant
from svo.studies.added import AddsExhibits
from svo.studies.configuration import StudyConfiguration
from svo.studies.isolation import tables
from svo.studies.isolation.figures import write_pictures
from svo.studies.isolation.interactive import interactive_section
from svo.studies.isolation.store import StudyFolder
from svo.studies.isolation.summary import ConditionSummary, summarise, write_summary
from svo.studies.page import Picture, Report, study_command, write_page
from svo.studies.runs import finished_runs, publish_beside

_NOTHING = Markup()
_GLOSSARY = {
    "falsified": "No initial state, disturbance, noise and uncertainty within a model's stated bounds explains the "
    "data. Said only with a certificate that was checked in exact rational arithmetic; it is proved given the bounds "
    "and the set of states at the start of the observer's window.",
    "detected": "The nominal model is falsified. The delay counts the first faulty sample as one sampling time: "
    "t_alarm − t_fault + Ts.",
    "isolated": "Only the true fault's model is left alive. The delay is counted in the same way.",
    "mean, median, 5–95 %": "The mean is over the runs that got there (its Student's 95 % interval is in summary.csv); "
    "median and quantiles are over all runs of the kind, ∞ where they fall among runs that did not get there.",
    "runs": "How many runs got there, of how many.",
    "false alarm": "The nominal model was falsified before the fault began, or in a fault-free run.",
    "wrong isolation": "The true fault's model was falsified, or another one was left alone.",
    "alive": "Not falsified: the model still explains everything that was measured. Several models alive at the end "
    "are no error; the data then do not tell them apart.",
    "undecided": "An answer that is neither a proof of falsification nor a point that explains the data (solver "
    "trouble). It is never an alarm.",
    "ended at a limit": "A program of an observer that was stopped, by a deadline, its pivots or the machine's memory, "
    "before it was solved. Its bound holds, but a set may be wider than it could be.",
}


def publish(
    folder: StudyFolder, plant: Plant, without_damaged: bool = False, formats: Sequence[str] = ()
) -> list[ConditionSummary]:
    """Write summary.csv, the pictures and report.html into the study's folder; returns the summaries.

    Raises
    ------
    ValueError
        If parts of the study are damaged, unless these are to be left out, or all runs failed.
    """
    every = folder.rows(without_damaged)
    rows, exemplars = finished_runs(every), folder.exemplars(without_damaged)
    summaries = summarise(rows)
    write_summary(folder.path / "summary.csv", summaries)
    pictures = write_pictures(folder.path, plant, summaries, exemplars, formats)
    failed = publish_beside(folder, plant, every)
    if isinstance(plant, AddsExhibits):
        asked = StudyConfiguration.from_dict(folder.identity()["configuration"])
        shown = plant.exhibits(folder.path, asked.runs, asked.seed, asked.noise)
        pictures += [Picture(exhibit.path, exhibit.title, exhibit.caption) for exhibit in shown]
    interactive = interactive_section(plant, rows, exemplars)
    write_report(folder.path / "report.html", plant, folder.identity(), summaries, pictures, interactive, failed)
    return summaries


def write_report(
    path: Path,
    plant: Plant,
    identity: Mapping[str, Any],
    summaries: Sequence[ConditionSummary],
    pictures: Iterable[Picture],
    interactive: Markup = _NOTHING,
    failed: Sequence[str] = (),
) -> None:
    """Write the report of a study.

    Parameters
    ----------
    path : path of the HTML file
    plant : Plant
        For its title, units and reference figures.
    identity : mapping
        "configuration" and "versions" of the study, as stored with it.
    summaries : sequence of ConditionSummary
    pictures : iterable of Picture
        Embedded into the page.
    interactive : Markup
        The views that a reader can move in (`svo.studies.isolation.interactive`).
    failed : sequence of str
        A line for each run that failed (`svo.studies.runs.failures`).
    """
    configuration = identity["configuration"]
    came_out = [*failed, *tables.counts(summaries), *tables.not_isolated(summaries), tables.cost(summaries)]
    report = Report(
        _subtitle(summaries, configuration),
        came_out,
        [tables.delay_table(plant, group) for group in _by_noise(summaries)],
        f"Paper: {plant.reference_title}; a dash where it says nothing." if plant.reference else "",
        list(pictures),
        _GLOSSARY,
        study_command(plant, configuration),
        configuration,
        identity["versions"],
        has_alarms=True,
        interactive=interactive,
    )
    script = own_file("report.js") if interactive else ""
    write_page(path, f"Isolation-time study: {plant.title}", script=script, report=report)


def _subtitle(summaries: Sequence[ConditionSummary], configuration: Mapping[str, Any]) -> str:
    runs = sum(s.runs for s in summaries)
    return f"{runs} runs, seed {configuration['seed']}, noise: {', '.join(configuration['noise'])}"


def _by_noise(summaries: Sequence[ConditionSummary]) -> list[list[ConditionSummary]]:
    names = dict.fromkeys(s.noise for s in summaries)
    return [[s for s in summaries if s.noise == noise] for noise in names]
