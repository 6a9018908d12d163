"""What an alarm or a proof claims that nothing explains, as instants that an exact witness is sought for."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks._exact_witness import Instant, Start
from benchmarks._forged_edits import Array
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.left_out import channels_of


def decoded(record: Any) -> Array:
    """An array of a record, read by nothing of the project."""
    words = record["hex"].split(" ") if record["hex"] else []
    return np.array([float.fromhex(word) for word in words], dtype=float).reshape(record["shape"])


def of_window(
    c: WindowCertificate, model: Sequence[Instant] | None = None
) -> tuple[list[Instant], Start, Array, list[Any]]:
    """What a window's proof claims that nothing explains; with the numbers of ``model`` in the place of its own."""
    instants, n = [], c.n
    for k, s in enumerate(c.samples):
        newest = k == len(c.samples) - 1
        factors = (s.gain, s.functional) if s.gain is not None else channels_of(s.stack, c.owner, c.delta, c.units)
        more: list[tuple[Array, float, float]] = []
        if not newest or c.late:
            before = np.zeros((len(c.w_rows), s.stack.shape[2] - c.w_rows.shape[1]))
            more += list(zip(np.hstack([before, c.w_rows]), c.w_rows_lower, c.w_rows_upper, strict=True))
        for q, (gain, functional) in enumerate(zip(*(factors or ([], [])), strict=True)):
            unused = newest and not ((c.late and gain[n:].any()) or s.s_lower[q] or s.s_upper[q])
            if not unused and (functional[:n].any() or functional[n + len(s.u) + 1 :].any()):
                more.append((functional, s.s_lower[q], s.s_upper[q]))
        added = s.slack + (0.0 if s.remainder is None else s.remainder)
        own = Instant(s.stack, s.u, s.y, s.noise, s.w_lower, s.w_upper) if model is None else model[k]
        y = np.where(np.isnan(s.y), np.nan, own.y)
        width = np.where(added > 0.0, np.nextafter(own.width + added, 0.0), own.width)
        instants.append(replace(own, y=y, width=width, more=[*own.more, *more], sums_width=added))
    items = range(1, len(c.samples[0].stack))
    mine = [c.delta[c.owner == item] for item in items]
    delta = np.array([(d[:, 0].max(), d[:, 1].min()) if len(d) else (0.0, 0.0) for d in mine]).reshape(-1, 2)
    sums = [] if c.sums is None else [
        (int(j), int(a) - c.first, int(b) - c.first, low, high)
        for j, a, b, low, high in zip(c.sums.column, c.sums.first, c.sums.last, c.sums.lower, c.sums.upper, strict=True)
    ]  # fmt: skip
    a = c.arrival
    return instants, Start((a.box_lower, a.box_upper), a.rows, a.lower, a.upper), delta, sums


def of_plant(record: Any, log: Any, first: int, last: int) -> tuple[list[Instant], Array]:
    """An observer's model in plant.json over samples of a log, and its bounds of Delta."""
    matrices = record["matrices"]
    stacks, n, nu = decoded(matrices["stacks"]), record["n"], record["inputs"]
    schedule = decoded(matrices["schedule"]) if "schedule" in matrices else None

    def stack(k: int) -> Array:
        if schedule is None:
            return stacks[k if len(stacks) > 1 else 0]
        points, s = decoded(matrices["points"]), schedule[k]
        if s <= points[0] or s >= points[-1]:
            return stacks[0 if s <= points[0] else -1]
        i = int(np.flatnonzero(points <= s)[-1])
        return (stacks[i + 1] - stacks[i]) / (points[i + 1] - points[i]) * (s - points[i]) + stacks[i]

    def at(name: str, k: int) -> Array:
        rows = decoded(record[name])
        return rows[k if len(rows) > 1 else 0]

    more = []
    rows = record["w_rows"]
    for row, low, high in zip(*(decoded(rows[key]) for key in ("rows", "lower", "upper")), strict=True):
        more.append((np.concatenate([np.zeros(n + nu + 1), row]), low, high))
    if record["physical"] is not None:
        axes = np.eye(n, n + nu + 1 + record["disturbances"])
        more += list(zip(axes, *map(decoded, record["physical"]), strict=True))
    instants = [
        Instant(stack(k), log.u[k], log.y[k], at("noise", k), at("w_lower", k), at("w_upper", k), more)
        for k in range(first, last + 1)
    ]
    return instants, decoded(record["delta"])


def set_of(record: Any) -> Start:
    return Start(
        (decoded(record["box_lower"]), decoded(record["box_upper"])),
        *(decoded(record[key]) for key in ("rows", "lower", "upper")),
    )


def anywhere(n: int) -> Start:
    return Start((np.full(n, -np.inf), np.full(n, np.inf)), np.zeros((0, n)), np.zeros(0), np.zeros(0))


class Truth:
    """Remembers what has been asked."""

    def __init__(self) -> None:
        self._known: dict[Any, bool] = {}

    def explained(self, key: Any, ask: Callable[[], bool]) -> bool:
        if key not in self._known:
            self._known[key] = ask()
        return self._known[key]


def one_reading(text: bytes) -> bool:
    """Whether every parser reads the same: ASCII, no entry twice, no number that JSON does not have."""

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len({key for key, _ in pairs}) != len(pairs):
            raise ValueError("twice")
        return dict(pairs)

    def none(word: str) -> Any:
        raise ValueError(word)

    try:
        for line in text.split(b"\n"):
            if line.strip():
                json.loads(line.decode("ascii"), object_pairs_hook=once, parse_constant=none)
    except ValueError:
        return False
    return True
