"""A bank of Kalman filters with probabilities: interacting multiple models, and MMAE without switching."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass

import numpy as np

from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.baselines.filter_kernel import multiple_models
from svo.baselines.linear_gaussian import GaussianModel, GaussianSamples
from svo.checks import Array, expect, positive_number
from svo.logs.log import Log


@dataclass(frozen=True)
class ModelProbabilities(Shown):
    """Over K samples: posterior (K, m) of the models, by ``names``, and log_odds (K,) of all but the first together."""

    names: tuple[str, ...]
    posterior: Array
    log_odds: Array


@options_by_name
@dataclass(frozen=True)
class MultipleModelFilter(Shown):
    """One Kalman filter a model, and the probability of each (Blom and Bar-Shalom 1988).

    Parameters
    ----------
    models : mapping of str to GaussianModel
        At least two; the first is the plant without a fault, from which any may be switched to and back.
    switching : float
        Probability in [0, 1) of leaving a model at a sample, shared by the others. Zero is MMAE, whose models
        never mix.
    process_noise : float
        Factor on the covariance of the process noise, for tuning.

    Raises
    ------
    ValueError
        For fewer than two models, or a number out of its range.
    """

    models: Mapping[str, GaussianModel]
    _: KW_ONLY
    switching: float = 1e-3
    process_noise: float = 1.0

    def __post_init__(self) -> None:
        if len(self.models) < 2:
            raise ValueError(f"models has {len(self.models)}; expected at least two, the first without a fault")
        expect(0 <= self.switching < 1, "switching", self.switching, "a probability in [0, 1)")
        positive_number("process_noise", self.process_noise, "factor")

    @property
    def transition(self) -> Array:
        """Probability (m, m) of going from each model to each."""
        m = len(self.models)
        matrix = np.full((m, m), self.switching / (m - 1))
        np.fill_diagonal(matrix, 1 - self.switching)
        return matrix

    def run(self, log: Log) -> ModelProbabilities:
        """All samples of a log."""
        return self.over([model.samples(log) for model in self.models.values()])

    def over(self, samples: list[GaussianSamples]) -> ModelProbabilities:
        """The same where ``samples``, the models along the log in the order of `models`, are known already."""
        m, K = len(samples), len(samples[0])
        first = next(iter(self.models.values()))
        xs = np.repeat(first.mean[None], m, axis=0)
        Ps = np.repeat(first.covariance[None], m, axis=0)
        before = np.maximum(np.arange(K) - 1, 0)  # each measurement follows from the sample before
        A, f, Q = (np.array([getattr(s, name)[before] for s in samples]) for name in ("A", "f", "Q"))
        C, g, R = (np.array([getattr(s, name) for s in samples]) for name in ("C", "g", "R"))
        log_odds, posterior = np.empty(K), np.empty((K, m))
        with np.errstate(divide="ignore"):  # the logarithm of no switching
            log_transition = np.log(self.transition)
        multiple_models(
            xs, Ps, np.full(m, -np.log(m)), True, log_transition, A, f, self.process_noise * Q, C, g, R, samples[0].y,
            log_odds, posterior,
        )  # fmt: skip
        return ModelProbabilities(tuple(self.models), posterior, log_odds)
