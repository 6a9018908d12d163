"""What is known of the servo-loop beforehand: bounds of its pole for the interval predictor (paper 001, section 4)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from aircraft.elevator.servo import Servo
from svo.interval import GainBounds, IntervalPredictor

INITIAL_RADIUS = 0.002  # rad


@dataclass(frozen=True)
class ServoGains:
    """``gc = 1 - gamma(u, y) T`` without force (19), ``gr = min(k1 + k2 |u - xc|, k3, 0.95 gamma T)``, ``h = 1``.

    The last term keeps the stability condition (17) where a large distance makes gamma T smaller than k3.

    Attributes
    ----------
    servo : Servo
    Ts : float
        Sampling time [s].
    kappa : (k1, k2, k3)
        k2 in 1/rad.
    """

    Ts: float
    servo: Servo = field(default_factory=Servo)
    kappa: tuple[float, float, float] = (0.03, 0.15, 0.06)

    def __call__(self, u: Any, y: Any, schedule: Any = None) -> GainBounds:
        """Bounds of a sample from its command and measurement; numbers or arrays (a `GainLaw`)."""
        step = self.servo.unloaded_rate(u - y) * self.Ts
        k1, k2, k3 = self.kappa
        return GainBounds(1.0 - step, k1, slope=k2, limit=np.minimum(k3, 0.95 * step))

    def predictor(self, first_command: float) -> IntervalPredictor:
        """A predictor of a servo-loop that starts at rest, within 2 mrad of its first command."""
        return IntervalPredictor(self, (first_command, INITIAL_RADIUS))
