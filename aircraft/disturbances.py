"""Band-limited noise: what the paper calls band-limited white noise, with the bounds that a set-membership
observer needs, or Gaussian, to see what becomes of observers whose bounds do not hold."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import get_args

import numpy as np
import scipy  # its parts load when they are used: detection needs no filter design
from numpy.typing import ArrayLike

from svo.checks import Array, expect, expect_one_of
from svo.plant import Distribution

RMS_PER_BOUND = 1 / 2.5
_SETTLING_PERIODS = 6.0  # of the cut-off: a second-order Butterworth has decayed by exp(-27) then


@dataclass(frozen=True)
class BandLimitedNoise:
    """White noise through a second-order Butterworth low-pass, scaled to an rms, per channel.

    Bounded: uniform white noise, and the scaled output clipped at the bounds. Gaussian: Gaussian white noise, the
    same rms, nothing clipped; 1.2 % of its samples lie outside the bounds.

    Parameters
    ----------
    bounds : (channels,) array
        Half-widths >= 0. The rms before clipping is bound / 2.5; no sample exceeds the bound unless Gaussian.
    cutoffs_hz : (channels,) array
        Cut-off frequencies, below half of the sampling frequency.
    Ts : float
        Sampling time [s].
    distribution : {"bounded", "gaussian"}

    Raises
    ------
    ValueError
        For shapes that differ, a negative bound, an unknown distribution, or a cut-off outside (0, 0.5 / Ts).
    """

    bounds: ArrayLike
    cutoffs_hz: ArrayLike
    Ts: float
    distribution: Distribution = "bounded"

    def __post_init__(self) -> None:
        expect_one_of("distribution", self.distribution, get_args(Distribution))
        bounds, cutoffs = np.array(self.bounds, dtype=float), np.array(self.cutoffs_hz, dtype=float)
        if bounds.ndim != 1 or bounds.shape != cutoffs.shape:
            shapes = f"bounds has shape {bounds.shape} and cutoffs_hz {cutoffs.shape}"
            raise ValueError(f"{shapes}; expected one value a channel in both")
        expect((bounds >= 0).all() and np.isfinite(bounds).all(), "bounds", bounds, "finite half-widths >= 0")
        expect(self.Ts > 0, "Ts", self.Ts, "a positive sampling time in seconds")
        highest = 0.5 / self.Ts
        expect(((cutoffs > 0) & (cutoffs < highest)).all(), "cutoffs_hz", cutoffs, f"frequencies in (0, {highest}) Hz")
        object.__setattr__(self, "bounds", bounds)
        object.__setattr__(self, "cutoffs_hz", cutoffs)

    def draw(self, samples: int, rng: np.random.Generator) -> Array:
        """A stationary realisation, (samples, channels); the filters have settled before its first row.

        From the same generator state a longer realisation begins with the shorter one.
        """
        filters = [_low_pass(float(cutoff), self.Ts) for cutoff in np.asarray(self.cutoffs_hz)]
        settling = max((length for _, length, _ in filters), default=0)
        shape = (settling + samples, len(filters))
        bounded = self.distribution == "bounded"
        # The variance of a uniform variable on [-1, 1] is 1/3.
        coloured = rng.uniform(-1.0, 1.0, shape) if bounded else rng.standard_normal(shape) / np.sqrt(3.0)
        for column, (sections, _, _) in zip(coloured.T, filters, strict=True):
            column[:] = scipy.signal.sosfilt(sections, column)
        gains = np.array([gain for _, _, gain in filters])
        bounds = np.asarray(self.bounds)
        noise: Array = coloured[settling:] * (RMS_PER_BOUND * bounds / gains)
        return np.clip(noise, -bounds, bounds) if bounded else noise


@cache
def _low_pass(cutoff: float, Ts: float) -> tuple[Array, int, float]:
    """Filter sections, samples until it has settled, and the rms of its output for uniform noise on [-1, 1]."""
    sections = scipy.signal.butter(2, cutoff, fs=1 / Ts, output="sos")
    settling = int(np.ceil(_SETTLING_PERIODS / (cutoff * Ts)))
    impulse = np.zeros(settling)
    impulse[0] = 1.0
    return sections, settling, float(np.sqrt(np.sum(scipy.signal.sosfilt(sections, impulse) ** 2) / 3))
