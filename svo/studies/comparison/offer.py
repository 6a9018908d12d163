"""What a plant offers if detectors can be set side by side on it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from svo.detectors.detector import Detector
from svo.plant import Distribution, Plant


@runtime_checkable
class ComparesDetectors(Protocol):
    """What a `Plant` offers besides if ``svo compare`` can set detectors side by side on it.

    Attributes
    ----------
    compared_faults : tuple of (fault, profile)
        The scenarios of the comparison.
    """

    compared_faults: tuple[tuple[str, str], ...]

    def with_noise(self, distribution: Distribution) -> Plant:
        """This plant with its noise drawn from a ``distribution``; models and bounds stay as they are.

        "bounded" is within the bounds of the noise set, "gaussian" of the same rms and unbounded.
        """
        ...

    def detectors(self, noise: str) -> Sequence[Detector]:
        """The detectors to compare with the noise set ``noise``; their names differ."""
        ...
