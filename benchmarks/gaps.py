"""Long gaps in the measurements: what an observer says in them, what they cost, and how soon its set is small again.

Run with ``python -m benchmarks.gaps --samples 1000000 --state DIR``. Each observer, and a bank of two, goes through a
gap of so many samples; every stage is saved in DIR, and the same command goes on from the last one. Then 10 + n samples
are measured: the box beside that of an observer that never was without (the same readings, an initial set of the same
size), and of one that keeps all readings since the return; the state must be inside. ``--plants 50`` compares so many
random plants whose observability matrix has a condition below 1e4, after the set was lost.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from polytopes import HPolytope
from svo import ArchitectureI, ConstrainedZonotopeObserver, UncertainModel, WindowObserver

Array = NDArray[np.float64]
STAGES, SEED = 10, 77_031
BEFORE = 60  # samples that the observer without a gap has had when measurements return


def rotation(**promise: Any) -> UncertainModel:
    """Stable; its boxes grow in a gap."""
    A = 0.98 * np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
    return UncertainModel(A, None, [[1.0, 0.0]], E=np.eye(2), w=[0.1, 0.1], n=0.05, **promise)


def unstable(**promise: Any) -> UncertainModel:
    """Its state may truly grow."""
    return UncertainModel([[1.05]], None, [[1.0]], E=[[1.0]], w=[0.1], n=0.05, **promise)


def start(model: UncertainModel) -> HPolytope:
    """First states within 1."""
    return HPolytope.box(-np.ones(model.n_states), np.ones(model.n_states))


def cases() -> dict[str, Any]:
    """Observers by what they are."""
    promises: dict[str, dict[str, Any]] = {
        "": {}, ", largest": {"largest": (-20.0, 20.0)}, ", physical": {"physical": (-20.0, 20.0)},
    }  # fmt: skip
    found: dict[str, Any] = {}
    for words, promise in promises.items():
        for name, model in (("rotation", rotation(**promise)), ("unstable", unstable(**promise))):
            for horizon in (1, 10):
                found[f"{name}, N = {horizon}{words}"] = WindowObserver(model, start(model), horizon=horizon)
        model = rotation(**promise)
        found[f"rotation, zonotope{words}"] = ConstrainedZonotopeObserver(model, start(model))
        wide = model.replace(w=[0.2, 0.2])
        found[f"rotation, bank{words}"] = ArchitectureI(
            WindowObserver(model, start(model)), {"wide": WindowObserver(wide, start(wide))}
        )
    return found


def nominal(driven: Any) -> Any:
    """The observer, or the nominal one of a bank."""
    return driven.observers["nominal"] if isinstance(driven, ArchitectureI) else driven


def blind(driven: Any, samples: int, path: Path | None) -> tuple[Any, float]:
    """So many samples without a measurement; what they were driven with, and the CPU time of this run's share."""
    nothing, done = np.full(nominal(driven).model.n_outputs, np.nan), 0
    if path is not None and path.exists():
        with np.load(path) as saved:
            state = dict(saved)
        done = int(state.pop("done"))
        if isinstance(driven, ArchitectureI):
            driven.load_state_dict(state)
        else:
            driven = type(driven).from_state_dict(driven.model, state)
    begun, first = process_time(), done
    stage = max(1, samples // STAGES)
    while done < samples:
        for k in range(done, min(done + stage, samples)):
            if k == 0:
                driven.update(nothing)
            else:
                driven.step(None, nothing)
        done = min(done + stage, samples)
        if path is not None:
            part = path.with_name(f"{path.stem}.part.npz")
            np.savez(part, done=done, **driven.state_dict())
            os.replace(part, path)
    return driven, (process_time() - begun) / max(done - first, 1)


def width_after(driven: Any, samples: int, rng: np.random.Generator) -> tuple[float, float, int, list[str]]:
    """Largest ratio of widths, to a run without a gap and to all readings since it, after so many measurements.

    Then the samples with the state outside, and the verdicts.
    """
    observer = nominal(driven)
    model = observer.model.replace(physical=None, largest=None)
    same = {"horizon": observer.horizon} if isinstance(observer, WindowObserver) else {}
    reference, since = type(observer)(model, start(model), **same), WindowObserver(model, start(model), horizon=None)
    since.lose_set()
    log = model.simulate(rng.uniform(-1.0, 1.0, model.n_states), np.zeros((BEFORE + samples, 0)), rng)
    outside, verdicts, ratios = 0, [], np.array([np.inf, np.inf])
    for k, (x, y) in enumerate(zip(log.x, log.y, strict=True)):
        steps = [reference.update(y) if k == 0 else reference.step(None, y)]
        if k < BEFORE:
            continue
        steps.append(since.update(y) if k == BEFORE else since.step(None, y))
        verdict = driven.step(None, y)
        step = verdict.steps["nominal"] if isinstance(driven, ArchitectureI) else verdict
        lower, upper = step.box
        outside += not ((lower <= x).all() and (x <= upper).all())
        verdicts.append(step.verdict)
        if k + 1 == BEFORE + samples:
            ratios = np.array([((upper - lower) / np.subtract(*other.box[::-1])).max() for other in steps])
    return float(ratios[0]), float(ratios[1]), outside, verdicts


def through_gaps(samples: int, folder: Path | None, words: str = "") -> Table:
    """Every case whose name has these words through a gap."""
    table = Table(title=f"{samples} samples without a measurement, then 10 + n with")
    columns = ("observer", "CPU us a sample", "in the gap", "to no gap", "to all since", "outside", "undecided after")
    for column in columns:
        table.add_column(column, justify="left" if column == "observer" else "right")
    for number, (name, driven) in enumerate(cases().items()):
        if words not in name:
            continue
        driven.warm_up()
        path = None if folder is None else folder / f"{number}.{samples}.npz"
        driven, seconds = blind(driven, samples, path)
        step = driven.step(None, np.full(1, np.nan))
        step = step.steps["nominal"] if isinstance(driven, ArchitectureI) else step
        says = f"{step.verdict}{f' ({step.reason})' if step.reason else ''}, {np.subtract(*step.box[::-1]).max():.2g}"
        rng = np.random.default_rng(SEED)
        ratio, limit, outside, verdicts = width_after(driven, 10 + nominal(driven).model.n_states, rng)
        figures = (f"{1e6 * seconds:.0f}", says, f"{ratio:.3f}", f"{limit:.3f}", str(outside))
        table.add_row(name, *figures, str(verdicts.count("undecided")))
    return table


class AfterLoss(NamedTuple):
    """Plants whose set was lost, 10 + n measurements later.

    Widths beside those of an observer that lost nothing and of one that keeps all readings since (each largest ratio of
    an axis), samples with the state outside, and false alarms.
    """

    to_no_gap: Array
    to_all_since: Array
    outside: int
    falsified: int


def after_loss(count: int, horizon: int = 10, seed: int = SEED) -> AfterLoss:
    """So many random plants of 1 to 5 states whose observability matrix has a condition below 1e4."""
    rng, ratios, outside, falsified = np.random.default_rng(seed), [], 0, 0
    while len(ratios) < count:
        n = int(rng.integers(1, 6))
        A = rng.normal(size=(n, n))
        A *= rng.uniform(0.5, 1.1) / np.abs(np.linalg.eigvals(A)).max()
        C = rng.normal(size=(int(rng.integers(1, n + 1)), n))
        if np.linalg.cond(np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(n)])) > 1e4:
            continue
        model = UncertainModel(A, None, C, E=np.eye(n), w=np.full(n, 0.1), n=0.05)
        lost = WindowObserver(model, start(model), horizon=horizon)
        lost.lose_set()
        lost.update(np.full(len(C), np.nan))
        ratio, limit, out, verdicts = width_after(lost, 10 + n, rng)
        ratios.append((ratio, limit))
        outside += out
        falsified += verdicts.count("falsified")
    to_no_gap, to_all_since = np.array(ratios).T
    return AfterLoss(to_no_gap, to_all_since, outside, falsified)


def random_plants(count: int, horizon: int = 10) -> Table:
    """A table of `after_loss`."""
    found = after_loss(count, horizon)
    table = Table(title=f"{count} random plants of 1 to 5 states, N = {horizon}: 10 + n samples after the set was lost")
    for column in ("width beside", "at most 1.01", "median", "largest", "state outside"):
        table.add_column(column, justify="right")
    for name, values in (("no gap", found.to_no_gap), ("all readings since", found.to_all_since)):
        near = int((values <= 1.01).sum())
        table.add_row(name, f"{near} of {count}", f"{np.median(values):.4f}", f"{values.max():.4f}", str(found.outside))
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=20_000, help="of the gap (20000)")
    parser.add_argument("--plants", type=int, default=50, help="random plants (50)")
    parser.add_argument("--only", default="", help="observers whose name has these words, such as bank (all)")
    parser.add_argument("--state", type=Path, help="folder to save each stage in, and to go on from")
    options = parser.parse_args()
    if options.state is not None:
        options.state.mkdir(parents=True, exist_ok=True)
    console = Console(width=140)
    console.print(random_plants(options.plants))
    console.print(through_gaps(options.samples, options.state, options.only))


if __name__ == "__main__":
    main()
