"""Interval detector of first-order systems: prediction, dead-zone residual, noise characterisation, thresholds.

Combastel, Thabet, Raïssi, Zolghadri and Gucik, IFAC World Congress 2014 (paper 001), the 1-D special case of
set-membership detection.
"""

from svo.interval.bounds import GainBounds, GainLaw
from svo.interval.detector import IntervalDetector, IntervalRecord, IntervalStep, ThresholdVerdict
from svo.interval.model import FirstOrderScheduler, first_order_model, first_order_schedule
from svo.interval.noise import CharacterizationCheck, NoiseCharacterization
from svo.interval.power_law import PowerLaw
from svo.interval.predictor import Interval, IntervalPrediction, IntervalPredictor
from svo.interval.residual import dead_zone, first_order_filter
from svo.interval.thresholds import filter_bound, threshold_sequence

__all__ = [
    "CharacterizationCheck",
    "FirstOrderScheduler",
    "GainBounds",
    "GainLaw",
    "Interval",
    "IntervalDetector",
    "IntervalPrediction",
    "IntervalPredictor",
    "IntervalRecord",
    "IntervalStep",
    "NoiseCharacterization",
    "PowerLaw",
    "ThresholdVerdict",
    "dead_zone",
    "filter_bound",
    "first_order_filter",
    "first_order_model",
    "first_order_schedule",
    "threshold_sequence",
]
