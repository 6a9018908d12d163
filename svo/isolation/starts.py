"""How an observer of a bank is started during a run, from a set that other observers have."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from svo.isolation.bank_state import Sample
from svo.observers.base import Observer, Step


def start_from(
    name: str,
    observer: Observer,
    set: HPolytope | None,
    at: Sample,
    y: ArrayLike | None = None,
    largest_at: int | None = None,
) -> Step:
    """Start an observer from a set of states at a sample; without y it only learns of inputs and schedule.

    None is a set that is lost. ``largest_at`` is that of what the set rests on, counted from the sample.
    """
    physical = observer.model.physical_range
    if set is not None and physical is not None and not physical.cut(*set.bounding_box())[2]:
        set = None  # no state of it is one of the plant, as nothing has proven yet
    if set is not None:
        observer.restart(set)
        if largest_at is not None:
            observer.largest_at = largest_at
    elif observer.starts_without_set:
        observer.lose_set()
    else:
        kind = type(observer).__name__
        raise TypeError(f"observer {name!r} ({kind}) has no lose_set, and there is no bounded set to start it from")
    return at.first(observer, nothing_of(observer) if y is None else y)


def predict_from(
    name: str, observer: Observer, set: HPolytope | None, before: Sample, now: Sample, largest_at: int | None
) -> Step:
    """Start from the set of the sample before, leaving out the measurement that nothing explains.

    One that came late leaves the set of its verdict, which is of the present sample: it is then the sample ``before``
    too. ``largest_at`` is counted from the present sample.
    """
    if now is before:
        return start_from(name, observer, set, now, largest_at=largest_at)
    start_from(name, observer, set, before, largest_at=None if largest_at is None else largest_at + 1)
    return now.to(observer, nothing_of(observer))


def nothing_of(observer: Observer) -> ArrayLike:
    """A measurement (ny,) of no sensor."""
    return np.full(observer.model.n_outputs, np.nan)
