"""What proves a falsification, whatever observer gave it: checked exactly, stored, compared with a model and a log."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self

import numpy as np

from polytopes.shown import Picture, Shown
from svo.checks import Array
from svo.logs.log import Log
from svo.models import ModelSample
from svo.store.values import decode_value, encode_value


class Evidence(Protocol):
    """Model and data of one sample: ``stack`` as `UncertainModel.stack` gave it; NaN in ``y`` = that was not used."""

    @property
    def stack(self) -> Array: ...
    @property
    def u(self) -> Array: ...
    @property
    def y(self) -> Array: ...
    @property
    def noise(self) -> Array: ...


class Certificate(Shown, ABC):
    """Proof that a model does not explain some data: a frozen dataclass of all that the proof needs.

    A kind of its own defines `verify` and `premise`, and has `samples`. To be stored with alarms it stands in
    `svo.observers.proof_record.KINDS`; fields that are arrays, numbers, polytopes, dataclasses or tuples of them
    are then written and read without further code.

    Attributes
    ----------
    kind : str
        Name of the kind in stored alarms.
    samples : tuple of Evidence
        Model and data of the samples that the proof is about, up to that of the falsification.
    """

    kind: ClassVar[str] = "own"

    if TYPE_CHECKING:  # a field or a property, as a kind likes

        @property
        def samples(self) -> tuple[Any, ...]: ...

    @abstractmethod
    def verify(self) -> bool:
        """Check the proof in exact rational arithmetic; True only if it holds.

        False, and no error, for arrays of wrong shapes and for numbers out of place: a stored proof may hold anything.
        """

    @abstractmethod
    def premise(self, sample: int) -> str:
        """What a proof that holds rests on, in words; its last sample is the log's ``sample``."""

    def _picture(self) -> Picture | None:
        """The readings that the proof is about, those that carry it ringed where the proof tells them."""
        if not self.samples:
            return None
        y = np.array([s.y for s in self.samples])
        weights = np.array([getattr(s, "on_output", np.zeros(y.shape[1])) for s in self.samples])

        def draw(ax: Any) -> None:
            for j, (readings, on) in enumerate(zip(y.T, weights.T, strict=True)):
                (line,) = ax.plot(readings, ".-", linewidth=0.7, label=f"y[{j}]")
                at = np.flatnonzero(on)
                ax.plot(at, readings[at], "o", markersize=9, fillstyle="none", color=line.get_color())
            ax.set(xlabel="sample of the proof, the last one falsifies", title="readings; ringed: they carry it")
            ax.legend(fontsize=8)

        return Picture(draw, 4.8, 3.0)

    def to_dict(self) -> dict[str, Any]:
        """What JSON can hold, floats in hexadecimal.

        Raises
        ------
        TypeError
            If the proof is none about the model, so that it cannot be stored.
        """
        return dict(encode_value(self))

    @classmethod
    def from_dict(cls, record: Any) -> Self:
        """What `to_dict` gave.

        Raises
        ------
        ArithmeticError, AttributeError, LookupError, TypeError, ValueError
            If the record is none of this kind.
        """
        certificate: Self = decode_value(cls, record)
        return certificate

    def model_data(self) -> tuple[ModelSample, ...]:
        """What the proof holds of its model, sample by sample."""
        return tuple(ModelSample(s.stack, s.noise, None) for s in self.samples)

    def difference(self, last: int, log: Log) -> str | None:
        """The first way in which the data are not those of a log whose sample ``last`` is the proof's last, or None.

        An observer that was started again counts its own samples. A measurement (NaN) that it did not use takes
        nothing from a proof.
        """
        first = last + 1 - len(self.samples)
        if first < 0:
            return f"samples {first} to {last} do not belong to a log of {len(log)} samples"
        for k, s in enumerate(self.samples, start=first):
            used = ~np.isnan(s.y)
            if used.shape != log.y[k].shape or not np.array_equal(s.y[used], log.y[k][used]):
                return f"y of sample {k} differs from the log"
            if (k < last or self._newest_input_counts()) and not np.array_equal(s.u, log.u[k]):
                return f"u of sample {k} differs from the log"
        return None

    def _newest_input_counts(self) -> bool:
        """Whether the input of the last sample is part of the proof: it enters the output there."""
        newest = self.samples[-1]
        n = newest.stack.shape[1] - newest.y.size
        return bool(newest.stack[:, n:, n : n + newest.u.size].any())


def started_again(largest_at: int | None, last: int, sample: int) -> str:
    """The premise of a set that started again; the observer's sample ``last`` is the log's ``sample``."""
    if largest_at is None:
        return ""
    return f", and the largest set at sample {sample - last + largest_at}, where the set started again"
