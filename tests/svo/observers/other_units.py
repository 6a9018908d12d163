"""The same plant, log and sets in units that are powers of two of the first ones."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from svo.logs.log import Log
from svo.models.model import UncertainModel

Array = NDArray[np.float64]
SIZES = {"x": "n_states", "u": "n_inputs", "y": "n_outputs", "w": "n_disturbances"}
ROW = dict.fromkeys("ABaE", "x") | dict.fromkeys("CDcF", "y")
COLUMN = {"A": "x", "B": "u", "E": "w", "C": "x", "D": "u", "F": "w"}


@dataclass(frozen=True)
class Units:
    """Exponents: a number v is written as 2^e v."""

    x: NDArray[np.int64]
    u: NDArray[np.int64]
    y: NDArray[np.int64]
    w: NDArray[np.int64]

    @classmethod
    def random(cls, rng: np.random.Generator, model: UncertainModel, most: int = 60) -> Units:
        return cls(*(rng.integers(-most, most + 1, getattr(model, size)) for size in SIZES.values()))

    def array(self, name: str, value: Any) -> Any:
        if value is None or callable(value):
            return None if value is None else lambda s: self.array(name, value(s))
        scaled = np.ldexp(np.asarray(value, dtype=float).T, getattr(self, ROW[name])).T
        return np.ldexp(scaled, -getattr(self, COLUMN[name])) if name in COLUMN else scaled

    def bound(self, name: str, value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(self.bound(name, end) for end in value)
        if isinstance(value, HPolytope):
            return self.set(name, value)
        if value is None or callable(value):
            return None if value is None else lambda s: self.bound(name, value(s))
        return np.ldexp(value, getattr(self, name))

    def set(self, name: str, P: HPolytope) -> HPolytope:
        """As a user writes it: bounds of single variables stay rows of 1 and -1."""
        e = getattr(self, name)
        parts = []
        for rows, bounds in ((P.A, P.b), (P.C, P.d)):
            single = np.count_nonzero(rows, axis=1) == 1
            own = np.where(single, (e * (rows != 0)).sum(axis=1), 0)
            parts += [np.ldexp(np.ldexp(rows, -e), own[:, None]), np.ldexp(bounds, own)]
        return HPolytope(*parts)

    def model(self, model: UncertainModel) -> UncertainModel:
        items = [replace(u, **{a: self.array(a, getattr(u, a)) for a in ROW}) for u in model.uncertainties]
        own = {a: self.array(a, getattr(model, a)) for a in ROW}
        return model.replace(**own, w=self.bound("w", model.w), n=self.bound("y", model.n), uncertainties=items)

    def log(self, log: Log) -> Log:
        x = None if log.x is None else np.ldexp(log.x, self.x)
        return replace(log, u=np.ldexp(log.u, self.u), y=np.ldexp(log.y, self.y), x=x)
