"""The observers of a bank that run: asked for their answers in the order of the bank, each error with a name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from time import perf_counter

from numpy.typing import ArrayLike

from svo.checks import expect, is_count, is_finite_number
from svo.isolation.bank_state import Sample
from svo.observers.base import Observer, Step


class Running:
    """Those of a bank's observers that are stepped.

    Parameters
    ----------
    observers : mapping of str to Observer
        All of the bank's.
    """

    def __init__(self, observers: Mapping[str, Observer]) -> None:
        self._every = dict(observers)
        self._refused_by: str | None = None
        self.observers: dict[str, Observer] = {}

    def choose(self, names: Iterable[str]) -> None:
        """These run from now on, in this order."""
        self.observers = {name: self._every[name] for name in names}

    def ask(self, call: Callable[[str], Step]) -> dict[str, Step]:
        """Their answers.

        Raises
        ------
        ValueError
            What an observer refuses. After a refusal by another than the first, those before it have seen the sample,
            and nothing more is asked.
        """
        if self._refused_by is not None:
            raise ValueError(
                f"observer {self._refused_by!r} refused a sample that others had already seen; call reset(set), or "
                "load_state_dict(state) of the sample before"
            )
        steps: dict[str, Step] = {}
        for name in self.observers:
            try:
                steps[name] = call(name)
            except Exception as error:
                self._refused_by = name if steps else None
                if type(error) is ValueError:
                    raise ValueError(f"observer {name!r}: {error}") from error
                raise
        return steps

    def ask_within(self, now: Sample, deadline: float) -> dict[str, Step]:
        """Their answers to a sample within so many seconds; each may take an equal share of what is left."""
        if not (is_finite_number(deadline) and deadline > 0):
            raise ValueError(f"deadline is {deadline}; expected seconds > 0, or None")
        end = perf_counter() + deadline
        for name, observer in self._every.items():
            if not observer.takes_deadline:
                raise ValueError(
                    f"deadline is given, but the step of observer {name!r} ({type(observer).__name__}) has none; leave "
                    "the deadline out, or this observer"
                )
        left = iter(range(len(self.observers), 0, -1))

        def timed(name: str) -> Step:
            share = max(0.0, end - perf_counter()) / next(left)
            return now.to(self.observers[name], now.y, deadline=share)

        return self.ask(timed)

    def ask_late(self, y: ArrayLike, sample: int, newest: int, nothing: ArrayLike) -> dict[str, Step]:
        """Their answers to a measurement (ny,) that came late; those whose window does not hold it take ``nothing``.

        ``sample`` and ``newest`` are counted as the bank counts. Each is asked whether it takes it before any changes.
        """
        taken = self._own_samples(sample, newest)
        held = any(own is not None for own in taken.values())
        expect(held, "sample", sample, "one in the window of a running observer")
        last = {name: observer.window[1] for name, observer in self.observers.items()}
        for name, own in taken.items():
            if own is not None:
                try:
                    self.observers[name].check_late(y, own)
                except ValueError as error:
                    raise ValueError(f"observer {name!r}: {error}") from error

        def late(name: str) -> Step:
            own, observer = taken[name], self.observers[name]
            return observer.late_update(nothing, last[name]) if own is None else observer.late_update(y, own)

        return self.ask(late)

    def _own_samples(self, sample: int, newest: int) -> dict[str, int | None]:
        """The number that each gives to a sample of the bank; None if its window does not hold it."""
        expect(is_count(sample, 0), "sample", sample, "the number of a sample")
        found: dict[str, int | None] = {}
        for name, observer in self.observers.items():
            if not observer.takes_late:
                raise TypeError(f"observer {name!r} ({type(observer).__name__}) takes no measurements that come late")
            first, last = observer.window
            own = sample - newest + last
            found[name] = int(own) if first <= own <= last else None
        return found
