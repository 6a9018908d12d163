"""Studies of interval detectors that are learnt anew in every run: detection times beside a paper's, false alarms."""

from svo.studies.thresholds.results import publish
from svo.studies.thresholds.run import LearnsDetectors
from svo.studies.thresholds.runner import run_detection_study
from svo.studies.thresholds.summary import DetectorSummary, summarise

__all__ = ["DetectorSummary", "LearnsDetectors", "publish", "run_detection_study", "summarise"]
