"""Studies of interval detectors that are learnt anew in every run: detection times beside a paper's, false alarms."""

from svo.interval.study.publish import publish
from svo.interval.study.run import LearnsDetectors
from svo.interval.study.runner import run_detection_study
from svo.interval.study.summary import DetectorSummary, summarise

__all__ = ["DetectorSummary", "LearnsDetectors", "publish", "run_detection_study", "summarise"]
