"""A model at the samples of a log: the one door by which a proof asks for matrices, bounds and data.

Of linear models: one that is linearised has the numbers of a sample only once the state there is known, and
`svo.observers.window.linearised_prover` makes them. The checker's counterpart is ``Model.stack`` and ``Model.bounds``.
"""

from __future__ import annotations

import numpy as np

from svo.checks import Array
from svo.logs.log import Log
from svo.models import ModelSample, NormalForm, UncertainModel
from svo.models.intervals import interval_of
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.sample import Sample


class ModelOnLog:
    """What a linear model says of each sample of a log, which is the claim of a proof.

    Parameters
    ----------
    model : UncertainModel
    first : ArrivalSet
        Contains the state at the log's first sample, in the user's units, which its size chooses powers of two for.
    log : Log
        With the schedule of the model.
    """

    def __init__(self, model: UncertainModel, first: ArrivalSet, log: Log) -> None:
        self.model, self.first, self.log = model, first, log
        self.form = NormalForm.at(model, first.box_lower, first.box_upper)
        self._per_w, self._per_y = 1.0 / self.form.w, 1.0 / self.form.y

    @property
    def delta(self) -> Array:
        """Bounds (items, 2) of each Delta."""
        return np.array([u.bounds for u in self.model.uncertainties]).reshape(-1, 2)

    def at(self, k: int) -> ModelSample:
        """Matrices and bounds of sample k, with the transition to the next one, in the user's units."""
        dt = self.log.interval_at(k + 1) if k + 1 < len(self.log) else None
        return ModelSample.of(self.model, self.log.schedule_at(k), interval_of(self.model, dt))

    def sample(self, k: int) -> Sample:
        """Sample k as a window takes it, in normal form."""
        form, log, found = self.form, self.log, self.at(k)
        assert found.w is not None
        lower, upper = found.w
        before = log.u[k - 1] if k else np.zeros(log.u.shape[1])
        return Sample(
            form.inputs(before), form.inputs(log.u[k]), form.outputs(log.y[k]), found.stack * form.exponents.factor,
            found.noise * self._per_y, lower * self._per_w, upper * self._per_w, log.y[k],
        )  # fmt: skip
