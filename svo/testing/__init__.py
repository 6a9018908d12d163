"""Conformance suites that a user's own observer, plant or detector is run through, as the project's own are.

Each rule has a name; the first that is broken is named in a `ConformanceError`, with what was seen and what to do.
"""

from svo.testing.detector import DETECTOR_RULES, check_detector
from svo.testing.observer import OBSERVER_RULES, check_observer
from svo.testing.observer_kind import Kind
from svo.testing.plant import PLANT_RULES, check_plant
from svo.testing.plant_runs import PlantRuns
from svo.testing.rules import Conformance, ConformanceError, Rule

__all__ = [
    "DETECTOR_RULES",
    "OBSERVER_RULES",
    "PLANT_RULES",
    "Conformance",
    "ConformanceError",
    "Kind",
    "PlantRuns",
    "Rule",
    "check_detector",
    "check_observer",
    "check_plant",
]
