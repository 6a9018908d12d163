"""What a user would take instead of set-valued observers: residual generators for Gaussian noise.

Each has ``run`` over a log, and ``start`` for a run sample by sample; the tests of `svo.residual_tests` evaluate
their residuals.
"""

from svo.baselines.kalman import InnovationFilter, Innovations, unknown_input_exists
from svo.baselines.linear_gaussian import GaussianModel, GaussianSamples, fault_effect
from svo.baselines.multiple_model import ModelProbabilities, MultipleModelFilter
from svo.baselines.parity import ParityRecord, ParitySpace

__all__ = [
    "GaussianModel",
    "GaussianSamples",
    "InnovationFilter",
    "Innovations",
    "ModelProbabilities",
    "MultipleModelFilter",
    "ParityRecord",
    "ParitySpace",
    "fault_effect",
    "unknown_input_exists",
]
