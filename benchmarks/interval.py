"""Speed of the interval detector and of the noise characterisation, against named alternatives in the same run.

The plant is the elevator's first-order model with a pole that depends on command and measurement, at 1 kHz. CPU times;
the best of several turns, since other work on the machine only adds.
"""

from __future__ import annotations

from collections.abc import Callable
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from aircraft.elevator.gains import ServoGains
from polytopes import HPolytope
from svo import Log, WindowObserver
from svo.interval import IntervalDetector, NoiseCharacterization, first_order_model, first_order_schedule
from svo.interval.noise import moving_average_extremes

Array = NDArray[np.float64]

TS = 0.001
SAMPLES = 1_000_000
QBAR = 1_000
SIGMA = 8e-4
GAINS = ServoGains(TS, kappa=(0.003, 0.015, 0.006))  # those of the elevator's 10 ms, for a tenth of it
ONLINE = 50_000
OBSERVED = 5_000


def main() -> None:
    """Print real-time factors and ratios."""
    log = _log()
    predictor = GAINS.predictor(float(log.u[0, 0]))
    residual = predictor.predict(log).residual
    learn = _best(lambda: NoiseCharacterization.from_records(residual, QBAR), 3)
    few = (1, 250, 500, 750, 1_000)
    sums = np.concatenate([[0.0], np.cumsum(residual)])
    plain = _best(lambda: [_plain(sums, q) for q in few], 3) * QBAR / len(few)
    agreement = max(abs(moving_average_extremes([residual], q)[-1] - _plain(sums, q)) for q in few)
    print(f"characterisation of {SAMPLES:,} samples, qbar = {QBAR:,}: {learn:.2f} s (aim 2 s)")
    print(f"    against numpy, cumulative sums once and one pass a q ({plain:.1f} s): {plain / learn:.0f} times faster")
    print(f"    largest difference of a bound: {agreement / residual.std():.0e} standard deviations")

    noise = NoiseCharacterization.from_records(residual, QBAR)
    detector = IntervalDetector(predictor, noise, pole=0.95)
    detector.warm_up()
    batch = _best(lambda: detector.run(log), 5) / SAMPLES
    online = _best(lambda: _online(detector, log), 3) / ONLINE
    observer = _observed(log, predictor)
    print(
        f"detector over a log: {1e6 * batch:.2f} us a sample, real-time factor at 1 kHz {TS / batch:,.0f} (aim 1,000)"
    )
    print(f"detector by samples: {1e6 * online:.2f} us a sample, real-time factor at 1 kHz {TS / online:,.0f} (aim 50)")
    ratio = observer / online
    print(f"set-valued observer of the same plant, N = 10: {1e6 * observer:.0f} us a sample, {ratio:.0f} times as much")


def _log() -> Log:
    rng = np.random.default_rng(0)
    time = TS * np.arange(SAMPLES)
    u = 0.1 * np.sin(0.3 * time) + 0.03 * np.sin(2.0 * time)
    center = GAINS.predictor(float(u[0])).predict(Log(time=time, u=u[:, None], y=u[:, None])).center
    y = center + SIGMA * rng.normal(size=SAMPLES)
    return Log(time=time, u=u[:, None], y=y[:, None])


def _plain(sums: Array, q: int) -> float:
    """The alternative: what one writes with numpy, a pass over the record's cumulative sums for each q."""
    return float(np.abs(sums[q:] - sums[:-q]).max() / q)


def _online(detector: IntervalDetector, log: Log) -> None:
    u, y = log.u[:ONLINE, 0].tolist(), log.y[:ONLINE, 0].tolist()
    detector.reset(u[0], 0.002)
    detector.update(y[0])
    for k in range(1, ONLINE):
        detector.step(u[k - 1], y[k])


def _observed(log: Log, predictor: Any) -> float:
    part = Log(time=log.time[:OBSERVED], u=log.u[:OBSERVED], y=log.y[:OBSERVED])
    scheduled = first_order_schedule(predictor.predict(part))
    observer = WindowObserver(first_order_model(6 * SIGMA, TS), HPolytope.box([-0.6], [0.6]), horizon=10)
    observer.warm_up()
    return _best(lambda: (observer.reset(HPolytope.box([-0.6], [0.6])), observer.run(scheduled)), 3) / OBSERVED


def _best(work: Callable[[], object], turns: int) -> float:
    work()
    times = []
    for _ in range(turns):
        begun = process_time()
        work()
        times.append(process_time() - begun)
    return min(times)


if __name__ == "__main__":
    main()
