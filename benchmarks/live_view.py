"""Lag of ``svo watch``: another process writes a flight of the Eclipse at 100 Hz, row by row.

Run with ``python -m benchmarks.live_view``. The lag of a row goes from the writer's clock when the row is written to
ours when the bank (four observers, quiet noise) has judged it and the view has been offered it. Wall time: it includes
what the scheduler of a busy machine adds.
"""

from __future__ import annotations

import io
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from svo.detection.watch.follow import FileLines
from svo.detection.watch.session import Session, Status
from svo.detection.watch.view import view_of
from svo.logs.file import write_log
from svo.plant import load_plant

PLANT, NOISE = "eclipse", "quiet"
_WRITER = """
import sys, time
source, target, period = sys.argv[1], sys.argv[2], float(sys.argv[3])
lines = open(source).read().splitlines()
with open(target, "w", buffering=1) as out:
    out.write(lines[0] + ",sent\\n")
    begun = time.perf_counter()
    for i, line in enumerate(lines[1:]):
        time.sleep(max(0.0, begun + period * i - time.perf_counter()))
        out.write(f"{line},{time.time()!r}\\n")
"""


@dataclass(frozen=True)
class Live:
    """Lags (K,) [s] of the rows of a flight, and the status at its end."""

    lags: NDArray[np.float64]
    status: Status


def follow(samples: int, terminal: bool) -> Live:
    """Follow a flight with an elevator fault as it is written; the view draws into memory."""
    plant = load_plant(PLANT)
    session = Session(plant, NOISE, "growing.csv")
    session.warm_up()
    view = view_of(Console(file=io.StringIO(), force_terminal=terminal, width=140), session)
    lags: list[float] = []
    with TemporaryDirectory() as folder:
        whole, growing = Path(folder) / "whole.csv", Path(folder) / "growing.csv"
        write_log(whole, plant.simulate("elevator", "step", NOISE, 0), plant.columns)
        whole.write_text("\n".join(whole.read_text().splitlines()[: samples + 1]) + "\n")
        growing.touch()
        lines = FileLines(growing, until_end=False)
        with subprocess.Popen([sys.executable, "-c", _WRITER, whole, growing, str(plant.Ts)]) as writer:
            while len(lags) < samples:
                for line in lines.read(wait=1.0) or []:
                    session.feed(line)
                    view.show(session.status, 0)
                    sent = line.text.rpartition(",")[2]
                    if sent != "sent":
                        lags.append(time.time() - float(sent))
                if writer.poll():
                    raise RuntimeError("the writing process failed")
        lines.close()
    status = session.status()
    view.close(status, "End of the flight")
    assert status is not None
    return Live(np.array(lags), status)


def main() -> None:
    """Measure and print."""
    live = follow(500, terminal=True)
    median, high, most, last = 1e3 * np.array(
        [np.median(live.lags), np.quantile(live.lags, 0.95), live.lags.max(), np.median(live.lags[-50:])]
    )
    print(
        f"{len(live.lags)} rows at 100 Hz with the live table: lag {median:.1f} ms (median), {high:.1f} ms (95 %), "
        f"{most:.1f} ms (largest), {last:.1f} ms (median of the last 50); "
        f"bank {1e3 * live.status.seconds_per_sample:.2f} ms a sample"
    )


if __name__ == "__main__":
    main()
