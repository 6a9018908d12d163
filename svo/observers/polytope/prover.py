"""Proves that a model explains no readings up to a sample by explicit sets, as a polytope observer has them.

The state after a sample is affine in Delta for the x and w before it, so that a direction of it is largest at a vertex
of Delta. A bound follows if at each vertex multipliers of what is known of x, w and the reading prove it: an ``x`` step
with ``vertices`` of `docs/proof_format.md`. Directions are the axes and the facets of the hull. Programs in floats
choose all numbers; of the bounds that the alarm rests on each is checked in exact arithmetic.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import QhullError

from polytopes import UndecidedError
from svo.checks import Array
from svo.models.state_range import within
from svo.observers.given_units import arrival_in
from svo.observers.polytope.proof_sample import ProofSample, StateBound, Unproven
from svo.observers.polytope.vertex_images import FacetLimitError
from svo.observers.window.chain_starts import Start
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.log_model import ModelOnLog
from svo.observers.window.proof_steps import start_step
from svo.observers.window.prover import ChainProver, ProvenChain
from svo.store.values import encode_value

_NO_SETS = (Unproven, UndecidedError, FacetLimitError, QhullError, np.linalg.LinAlgError)


class HullProver:
    """Proves falsifications of one model over one log by windows, and where these do not by hulls over Delta.

    Parameters
    ----------
    windows : ChainProver
    of : ModelOnLog
    max_facets : int or None
        Of a set, as of the `svo.PolytopeObserver`.
    """

    def __init__(self, windows: ChainProver, of: ModelOnLog, max_facets: int | None) -> None:
        self._windows, self._of, self._max_facets = windows, of, max_facets

    @property
    def reason(self) -> str:
        """Why the last claim was not proven."""
        return f"{self._windows.reason}, nor is one of hulls over the vertices of Delta"

    @property
    def unproven(self) -> tuple[str, ...]:
        """Bounds of windows that were not proven."""
        return self._windows.unproven

    def prove(self, sample: int) -> ProvenChain | None:
        """The proof that no trajectory explains the readings up to a sample, or None; `reason` says why."""
        windows = self._windows
        return windows.over_hulls(sample) or self.by_hulls(sample) or windows.by_signs(sample)

    def by_hulls(self, sample: int) -> ProvenChain | None:
        """The same by explicit sets alone; without uncertainties a window says as much."""
        if not self._of.model.uncertainties:
            return None
        for start in self._windows.starts(sample):
            sets = _Sets(self._of, start, sample, self._max_facets)
            if sets.alarm is not None and sets.are_proven():
                count = sum(len(bounds) for bounds, _ in sets.needed)
                return ProvenChain(start, count, None, sets.steps(), self._windows.given(start))
        return None


class _Sets:
    """The sets from a start on, until a reading is not in them.

    Attributes
    ----------
    alarm : array or None
        Multipliers at the last of the samples.
    """

    def __init__(self, of: ModelOnLog, start: Start, last: int, max_facets: int | None) -> None:
        self._start, self._form, self.alarm = start, of.form, None
        self._samples: list[ProofSample] = []
        self._bounds: list[list[StateBound]] = []
        known = arrival_in(start.set, of.form)
        try:
            for k in range(start.sample, last + 1):
                sample = ProofSample(of, k, self._cut(known))
                self._samples.append(sample)
                self.alarm = sample.contradiction()
                if self.alarm is not None or k == last:
                    return
                self._bounds.append(sample.bounds(np.vstack([self._axes, sample.facets(max_facets)])))
                known = self._set(self._bounds[-1])
        except _NO_SETS:
            return

    @property
    def _axes(self) -> Array:
        """Upwards, then downwards."""
        axes = np.eye(self._form.x.size)
        return np.vstack([axes, -axes])

    def _cut(self, known: ArrivalSet) -> ArrivalSet:
        lower, upper = within(self._form.model.physical_range, known.box_lower, known.box_upper)
        return ArrivalSet(lower, upper, known.rows, known.lower, known.upper)

    def _set(self, bounds: list[StateBound]) -> ArrivalSet:
        n, values = self._form.x.size, np.array([bound.value for bound in bounds])
        rows = np.array([bound.direction for bound in bounds[2 * n :]]).reshape(-1, n)
        return ArrivalSet(-values[n : 2 * n], values[:n], rows, np.full(len(rows), -np.inf), values[2 * n :])

    @cached_property
    def needed(self) -> list[tuple[list[StateBound], list[int]]]:
        """Of each sample after the first the bounds that the alarm rests on, its box first, and which rows they are."""
        found, box = [], 2 * self._form.x.size
        multipliers = [] if self.alarm is None else [self.alarm]
        for sample, bounds in zip(self._samples[:0:-1], self._bounds[::-1], strict=True):
            rests_on = [*multipliers, *sample.channel_multipliers]
            kept = np.flatnonzero(np.any([m[: len(bounds) - box] for m in rests_on], axis=0)).tolist()
            mine = [*bounds[:box], *(bounds[box + i] for i in kept)]
            multipliers = [m for bound in mine for m in bound.multipliers]
            found.append((mine, kept))
        return found[::-1]

    def are_proven(self) -> bool:
        """Whether all of these, and what they rest on, follow in exact arithmetic."""
        follow = zip(self._samples, self.needed, strict=False)
        return all(s.channels_hold() for s in self._samples) and all(s.holds(b) for s, (of, _) in follow for b in of)

    def steps(self) -> list[dict[str, Any]]:
        """As `docs/proof_format.md` has them."""
        n = self._form.x.size
        found, kept = [start_step(self._start, np.zeros((0, n)))], list(range(len(self._samples[0].known.rows)))
        for before, (bounds, rows) in zip(self._samples, self.needed, strict=False):
            directions = np.array([bound.direction for bound in bounds[2 * n :]]).reshape(-1, n) / self._form.x
            found += before.channel_steps(kept)
            found.append({"step": "directions", "sample": before.k + 1, "rows": encode_value(directions)})
            for i, bound in enumerate(bounds):
                row, side = (i % n, i // n) if i < 2 * n else (i - n, 0)
                found.append(before.state_step(bound, row, side, kept))
            kept = rows
        assert self.alarm is not None
        last = self._samples[-1]
        return [*found, *last.channel_steps(kept), {"step": "alarm", **last.entries(last.k, self.alarm, kept)}]
