"""Tests that turn a scalar residual into a Boolean decision (Marzat et al. 2012, section 5).

Every test is a `ResidualTest`: ``run`` over an array, or ``start`` and one ``step`` a sample, with the same answers.
"""

from svo.residual_tests.chi_square import ChiSquare
from svo.residual_tests.cusum import CUSUM
from svo.residual_tests.interface import Decision, DecisionRecord, OnlineTest, ResidualTest
from svo.residual_tests.likelihood import GLR, SPRT
from svo.residual_tests.student import StudentT
from svo.residual_tests.subsampling import RandomizedSubsampling
from svo.residual_tests.threshold import BoundedThreshold, StaticThreshold, propagated_bounds
from svo.residual_tests.whitening import Whitening, normalised_sum

__all__ = [
    "CUSUM",
    "GLR",
    "SPRT",
    "BoundedThreshold",
    "ChiSquare",
    "Decision",
    "DecisionRecord",
    "OnlineTest",
    "RandomizedSubsampling",
    "ResidualTest",
    "StaticThreshold",
    "StudentT",
    "Whitening",
    "normalised_sum",
    "propagated_bounds",
]
