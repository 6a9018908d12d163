"""From a finished study's folder to what people read: summary.csv, pictures and report.html."""

from __future__ import annotations

from svo.plant import Plant
from svo.study.figures import write_pictures
from svo.study.interactive import interactive_section
from svo.study.report import write_report
from svo.study.store import StudyFolder
from svo.study.summary import ConditionSummary, summarise, write_summary


def publish(folder: StudyFolder, plant: Plant) -> list[ConditionSummary]:
    """Write summary.csv, the pictures and report.html into the study's folder; returns the summaries."""
    rows, exemplars = folder.rows(), list(folder.exemplars())
    summaries = summarise(rows)
    write_summary(folder.path / "summary.csv", summaries)
    pictures = write_pictures(folder.path, plant, summaries, exemplars)
    interactive = interactive_section(plant, rows, exemplars)
    write_report(folder.path / "report.html", plant, folder.identity(), summaries, pictures, interactive)
    return summaries
