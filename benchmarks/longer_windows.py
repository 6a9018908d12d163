"""A longer window is never wider: widths of window observers of linear plants, at every sample, against the claims.

Run with ``python -m benchmarks.longer_windows --family small --count 200``. Claims, for programs solved to optimality:

same block       N' = N + i b that slides by the same b samples: width(N') <= (1 + 1e-6) width(N) + rounding
all data         ``horizon=None`` is never wider than N or N', by the same measure
usual blocks     2 N // 5 samples, so that the ends of windows do not nest: the mean width grows by at most 1 %

The rounding is `room`. Plant i of a family is drawn from seed (SEED, n, N, i), so a run goes on where another ended
(``--first``). Ends on a line that counts comparisons and failures; exit code 1 if a claim fails or a program has
stopped.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from time import process_time
from typing import Any

import numpy as np

from benchmarks._observers import arguments, linear_plant
from polytopes import HPolytope
from svo import UncertainModel, WindowObserver
from svo.checks import Array
from svo.logs.drive import drive
from svo.logs.log import Log

SEED = 20_261_130
RELATIVE, MEAN = 1e-6, 1e-2
FAMILIES = {"small": (8, 50, 200), "n20": (20, 50, 10), "n50": (50, 20, 5), "N200": (4, 200, 5)}
"""Largest number of states (drawn from 1 on in "small", else that), longest window, number of plants."""


@dataclass
class Found:
    """What one or several plants showed."""

    comparisons: int = 0
    failures: int = 0
    stopped: int = 0
    worst: float = -np.inf  # of a width, beyond the room
    bare: float = -np.inf  # the same without room
    growth: list[float] = field(default_factory=list)

    def add(self, other: Found) -> None:
        self.comparisons += other.comparisons
        self.failures += other.failures
        self.stopped += other.stopped
        self.worst, self.bare = max(self.worst, other.worst), max(self.bare, other.bare)
        self.growth += other.growth


def sliding_by(block: int, model: UncertainModel, start: HPolytope, horizon: int) -> WindowObserver:
    """A window observer that slides by so many samples, which it must hold."""
    assert 1 <= block <= horizon
    observer = WindowObserver(model, start, horizon=horizon)
    observer._configure(replace(observer._settings, slide=block))
    observer._begin(observer._initial)
    return observer


def room(observer: WindowObserver) -> Array:
    """What rounding may add to each width: 2 (samples in the window) (eps size + error), in units of the state.

    The rows of every sample are widened by eps times the size of their terms, and by the error of the state that they
    were computed from. Both follow the box of the window's first state, which is larger the earlier it lies; `size` and
    `error` are the largest bounds of |x| and of that error at the samples of the window.
    """
    memory, form = observer._window.memory, observer._form
    first, last = observer.window
    s = np.arange(memory.base, memory.time + 1) % (memory.size.N + 1)
    size, error = memory.arrays["mag"][s].max(), memory.arrays["err"][s].max()
    return 2.0 * (last - first + 1) * (observer.eps * size + error) * form.x


def widths(observer: WindowObserver, log: Log, every: int) -> tuple[Array, Array]:
    """Widths and their room at every so many samples, (samples, n) each."""
    found, rooms = [], []
    for k, step in enumerate(drive(observer, log)):
        assert step.verdict == "consistent"
        if k % every == every - 1:
            lower, upper = step.box
            found.append(upper - lower)
            rooms.append(room(observer))
    return np.array(found), np.array(rooms)


def examine(family: str, i: int, samples: int | None = None, every: int = 1) -> Found:
    """One plant with windows that nest, with all data, and with windows that slide by 2 N // 5."""
    largest, longest, _ = FAMILIES[family]
    rng = np.random.default_rng([SEED, largest, longest, i])
    n = int(rng.integers(1, largest + 1)) if family == "small" else largest
    sensors, gusts = (int(rng.integers(1, max(2, n // 2) + 1)) for _ in range(2))
    model = linear_plant(rng, n, sensors, gusts)
    block = int(rng.integers(1, longest // 3 + 1))
    times = int(rng.integers(1, longest // block))
    short = int(rng.integers(block, longest - times * block + 1))
    long = short + times * block
    log = model.simulate(rng.uniform(-0.5, 0.5, n), np.zeros((samples or long + 3 * block + 10, 0)), rng)
    start = HPolytope.box(-np.ones(n), np.ones(n))
    observers: dict[Any, WindowObserver] = {
        "short": sliding_by(block, model, start, short),
        "long": sliding_by(block, model, start, long),
        "all": WindowObserver(model, start, horizon=None),
        "usual short": WindowObserver(model, start, horizon=short),
        "usual long": WindowObserver(model, start, horizon=long),
    }
    measured = {name: widths(observer, log, every) for name, observer in observers.items()}
    found = Found(stopped=sum(observer.stopped for observer in observers.values()))
    pairs = [("short", "long"), ("short", "all"), ("long", "all"), ("usual short", "all"), ("usual long", "all")]
    for shorter, longer in pairs:
        (wide, _), (narrow, rooms) = measured[shorter], measured[longer]
        beyond = (narrow - wide - rooms) / wide
        found.comparisons += beyond.size
        found.failures += int((beyond > RELATIVE).sum())
        found.worst = max(found.worst, float(beyond.max()))
        found.bare = max(found.bare, float(((narrow - wide) / wide).max()))
    found.growth.append(float(np.mean(measured["usual long"][0] / measured["usual short"][0])) - 1.0)
    return found


def main(given: list[str] | None = None) -> None:
    """Examine plants of a family and count."""
    parser = arguments("longer_windows", __doc__, out=False)
    parser.add_argument("--family", choices=FAMILIES, default="small")
    parser.add_argument("--first", type=int, default=0, help="number of the first plant")
    parser.add_argument("--count", type=int, help="plants; 10 of the small ones and 1 of the others by default")
    parser.add_argument("--samples", type=int, help="of each log; the longer window and three slides by default")
    parser.add_argument("--every", type=int, default=1, help="samples from one comparison to the next")
    options = parser.parse_args([] if given is None else given)
    total, count = Found(), options.count or (10 if options.family == "small" else 1)
    for i in range(options.first, options.first + count):
        begun = process_time()
        found = examine(options.family, i, options.samples, options.every)
        total.add(found)
        print(
            f"plant {i}: {found.comparisons} widths, {found.failures} wider, worst {found.worst:+.2g} of a width, "
            f"{found.bare:+.2g} with the rounding; mean {100 * found.growth[0]:+.3g} %; {found.stopped} stopped; "
            f"{process_time() - begun:.1f} s",
            flush=True,
        )
    mean = float(np.mean(total.growth))
    print(f"usual blocks: the mean width of the longer window is {100 * mean:+.3g} % of the shorter's away")
    failures = total.failures + total.stopped + (mean > MEAN)
    worst = f"worst {total.worst:+.2g} of a width beyond the rounding, {total.bare:+.2g} with it"
    print(f"{total.comparisons} widths compared, {failures} failures; {worst}")
    if failures:
        raise SystemExit(1)


if __name__ == "__main__":
    main(sys.argv[1:])
