"""From a finished study's folder to what people read: summary.csv, pictures and report.html."""

from __future__ import annotations

from svo.plant import Plant
from svo.studies.added import AddsExhibits
from svo.studies.configuration import StudyConfiguration
from svo.studies.isolation.figures import write_pictures
from svo.studies.isolation.interactive import interactive_section
from svo.studies.isolation.report import write_report
from svo.studies.isolation.store import StudyFolder
from svo.studies.isolation.summary import ConditionSummary, summarise, write_summary
from svo.studies.page import Picture
from svo.studies.runs import finished_runs, publish_beside


def publish(folder: StudyFolder, plant: Plant, without_damaged: bool = False) -> list[ConditionSummary]:
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
    pictures, failed = write_pictures(folder.path, plant, summaries, exemplars), publish_beside(folder, plant, every)
    if isinstance(plant, AddsExhibits):
        asked = StudyConfiguration.from_dict(folder.identity()["configuration"])
        shown = plant.exhibits(folder.path, asked.runs, asked.seed, asked.noise)
        pictures += [Picture(exhibit.path, exhibit.title, exhibit.caption) for exhibit in shown]
    interactive = interactive_section(plant, rows, exemplars)
    write_report(folder.path / "report.html", plant, folder.identity(), summaries, pictures, interactive, failed)
    return summaries
