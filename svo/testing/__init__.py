"""Conformance suites that a user's own plant is run through, as the project's own are.

Each rule has a name; the first that is broken is named in a `ConformanceError`, with what was seen and what to do.
"""

from svo.testing.plant import PLANT_RULES, check_plant
from svo.testing.plant_runs import PlantRuns
from svo.testing.rules import Conformance, ConformanceError, Rule

__all__ = ["PLANT_RULES", "Conformance", "ConformanceError", "PlantRuns", "Rule", "check_plant"]
