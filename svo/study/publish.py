"""From a finished study's folder to what people read: summary.csv, pictures and report.html."""

from __future__ import annotations

from svo.plant import AddsExhibits, Plant
from svo.study.figures import Picture, write_pictures
from svo.study.report import write_report
from svo.study.store import StudyFolder
from svo.study.summary import ConditionSummary, summarise, write_summary


def publish(folder: StudyFolder, plant: Plant) -> list[ConditionSummary]:
    """Write summary.csv, the pictures and report.html into the study's folder; returns the summaries."""
    summaries = summarise(folder.rows())
    write_summary(folder.path / "summary.csv", summaries)
    pictures = write_pictures(folder.path, plant, summaries, list(folder.exemplars()))
    if isinstance(plant, AddsExhibits):
        asked = folder.identity()["configuration"]
        added = plant.exhibits(folder.path, asked["runs"], asked["seed"], asked["noise"])
        pictures += [Picture(exhibit.path, exhibit.title, exhibit.caption) for exhibit in added]
    write_report(folder.path / "report.html", plant, folder.identity(), summaries, pictures)
    return summaries
