"""What the checker of proofs makes of any multipliers holds on runs, in rationals, with every bound at a corner."""

from __future__ import annotations

import math
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.svo.detection.checkers import CHECK

SAMPLES = 4


def array(values: Any) -> dict[str, Any]:
    values = np.asarray(values, float)
    return {"shape": list(values.shape), "hex": " ".join(float(v).hex() for v in values.ravel())}


class Trajectory:
    """A plant of short dyadic numbers, and a run of it: all of it is in floats without rounding."""

    parts: tuple[float, ...] = 0.0, 1.0  # of the way from the lower end of Delta to the upper one

    def __init__(self, seed: int) -> None:
        self.rng = rng = np.random.default_rng(seed)
        self.least = -4 * int(rng.integers(2))  # where nothing is negative, bounds of sizes are reached too
        self.n, self.nu, self.ny, self.nw, self.items, self.nh = (int(rng.integers(*r)) for r in
            ((1, 3), (0, 2), (1, 3), (0, 3), (0, 3), (0, 2)))  # fmt: skip
        self.columns = self.n + self.nu + 1 + self.nw
        self.stacks = self.short(int(rng.choice([1, SAMPLES])), 1 + self.items, self.n + self.ny, self.columns)
        self.delta = np.sort(self.short(self.items, 2))
        self.w = self.short(SAMPLES, self.nw)
        self.rows = self.short(self.nh, self.nw)
        self.x, self.u = [self.short(self.n)], self.short(SAMPLES, self.nu)
        self.noise, self.remainder = abs(self.short(SAMPLES, self.ny)), abs(self.short(1, self.ny))
        self.v = self.noise * rng.choice([-1.0, 1.0, 0.5], self.noise.shape)
        self.y = np.zeros((SAMPLES, self.ny))
        self.z = []
        for k in range(SAMPLES):
            self.z.append(np.concatenate((self.x[k], self.u[k], [1.0], self.w[k])))
            held = [low + rng.choice(self.parts) * (high - low) for low, high in self.delta]
            stack = self.stacks[min(k, len(self.stacks) - 1)]
            after = (stack[0] + sum((d * s for d, s in zip(held, stack[1:], strict=True)), 0.0)) @ self.z[k]
            self.x.append(after[: self.n])
            self.y[k] = after[self.n :] + self.v[k] + self.remainder[0] * rng.choice([-1.0, 1.0], self.ny)
        self.y[rng.random(self.y.shape) < 0.3] = np.nan

    def short(self, *shape: int) -> Any:
        return self.rng.integers(self.least, 5, shape) / 4.0 * (self.rng.random(shape) < 0.8)

    def few(self, *shape: int) -> Any:
        """Multipliers most of which are zero: a row that is wrong is not covered by the room of others."""
        sign = self.rng.choice([-1.0, 1.0], shape)
        return sign * self.short(*shape) * (self.rng.random(shape) < 0.4) * (self.rng.random() < 0.5)

    def around(self, values: Any) -> tuple[Any, Any]:
        """Bounds with the values at one end or the other, or inside."""
        room = [abs(self.short(*np.shape(values))) * (self.rng.random(np.shape(values)) < 0.5) for _ in range(2)]
        return values - room[0], values + room[1]

    def sums(self) -> list[dict[str, Any]]:
        """Bounds of sums that are as near as this run allows, on both sides."""
        found = []
        for column in range(self.ny + self.nw):
            q = int(self.rng.integers(1, 4))
            of = self.v[:, column] if column < self.ny else self.w[:, column - self.ny]
            runs = [of[k : k + q].sum() for k in range(SAMPLES + 1 - q)]
            found.append({"column": column, "samples": q, "ends": array([min(runs), max(runs)])})
        return found

    def record(self) -> dict[str, Any]:
        low, high = self.around(self.w)
        directions = self.short(1, self.n)
        box, ends = self.around(self.x[0]), self.around(directions @ self.x[0])
        w_ends = [(self.w @ self.rows.T).min(axis=0), (self.w @ self.rows.T).max(axis=0)]
        return {
            "n": self.n, "inputs": self.nu, "outputs": self.ny, "disturbances": self.nw,
            "matrices": {"stacks": array(self.stacks)}, "delta": array(self.delta), "noise": array(self.noise),
            "w_lower": array(low), "w_upper": array(high), "sums": self.sums(), "remainder": array(self.remainder),
            "w_rows": {"rows": array(self.rows), "lower": array(w_ends[0]), "upper": array(w_ends[1])},
            "first": {"box_lower": array(box[0]), "box_upper": array(box[1]),
                      "rows": array(directions), "lower": array(ends[0]), "upper": array(ends[1])},
            "physical": None, "largest": None,
        }  # fmt: skip

    def chain(self) -> Any:
        """A chain with bounds of states, and of s, that hold on this run."""
        log = SimpleNamespace(time=list(range(SAMPLES)), u=self.u.tolist(), y=self.y.tolist())
        chain = CHECK.Chain(CHECK.Model(self.record()), log, SAMPLES - 1)
        template = self.short(1, self.n)
        chain.take({"step": "start", "sample": 0, "from": "first", "template": array(template)})
        for k in range(SAMPLES):
            for row, value in enumerate([*self.x[k], *(template @ self.x[k])]):
                low, high = self.around(value)
                chain.bounds |= {(k, row, -1): float(low), (k, row, 1): float(high)}
            nq = int(self.rng.integers(0, 3)) if self.items else 0
            gain, functional = self.short(nq, self.n + self.ny), self.short(nq, self.columns)
            owner = [int(self.rng.integers(1, self.items + 1)) for _ in range(nq)]
            step = {"step": "channels", "sample": k, "owner": owner, "gain": array(gain.reshape(nq, self.n + self.ny))}
            chain.take(step | {"functional": array(functional.reshape(nq, self.columns))})
            for q, s in enumerate(functional @ self.z[k]):
                low, high = self.around(s)
                chain.channels[k][4].update({(k, q, -1): float(low), (k, q, 1): float(high)})
        return chain

    def step(self, chain: Any, ends_at: tuple[int, int] | None = None) -> dict[str, Any]:
        """Any multipliers on any window, or on that one."""
        first, last = ends_at or sorted(int(k) for k in self.rng.integers(0, SAMPLES, 2))
        window = range(first, last + 1)
        ends = [(i, k) for i, (_, q, *_) in enumerate(chain.model.sums) for k in window if k - q + 1 >= first]
        lines, numbers = [], []
        for k in window:
            for q, owner in enumerate(chain.channels[k][0]):
                side, slope = int(self.rng.integers(2)), float(self.short())
                s = [chain.channels[k][4][k, q, end] for end in (-1, 1)]
                corners = [(d - slope) * v for d in chain.model.delta[owner - 1] for v in s]
                lines.append([k - first, q, side])
                numbers.append([abs(float(self.few())), slope, min(corners) if side else max(corners)])
        return {
            "first": first, "last": last, "on_start": array(self.few(1)),
            "on_output": array(np.where(np.isnan(self.y[first : last + 1]), 0.0, self.few(len(window), self.ny))),
            "on_w": array(self.few(len(window), self.nh)), "on_sum": [list(end) for end in ends],
            "sum": array(self.few(len(ends), 1)), "on_line": lines, "line": array(np.reshape(numbers, (-1, 3))),
        }  # fmt: skip


def exact(number: Any) -> Fraction:
    return number.m[0] * Fraction(2) ** number.e


@pytest.mark.parametrize("seeds", [range(300), pytest.param(range(300, 3000), marks=pytest.mark.slow)])
def test_any_multipliers_prove_only_what_holds_on_a_run(seeds: range) -> None:
    tight = 0
    for seed in seeds:
        run = Trajectory(seed)
        chain = run.chain()
        for _ in range(3):
            step = run.step(chain)
            at = int(run.rng.integers(step["first"], step["last"] + 1))
            d = run.few(run.columns).tolist()
            total = exact(chain._total(step, at, CHECK.Vec.of(d)))
            value = sum((Fraction(a) * Fraction(b) for a, b in zip(d, run.z[at].tolist(), strict=True)), Fraction(0))
            assert total <= -value, seed
            assert exact(chain._total(step)) <= 0, seed
            tight += math.isclose(total, -value)
    assert tight > len(seeds) // 100  # some bounds are reached: none has room to spare


class Full(Trajectory):
    """Numbers with all their digits, where a product is rounded down as often as up."""

    def short(self, *shape: int) -> Any:
        return super().short(*shape) * (1.0 + self.rng.random(shape)) / 3.0

    def record(self) -> dict[str, Any]:
        """Without rows: the run's own numbers miss their ends by a rounding."""
        found, ends = super().record(), {"lower": array([]), "upper": array([])}
        for name, columns in (("first", self.n), ("w_rows", self.nw)):
            found[name] |= {"rows": array(np.zeros((0, columns)))} | ends
        return found


def exactly(values: Any) -> list[Fraction]:
    return [abs(Fraction(float(v))) for v in values]


def test_sizes_that_are_rounded_are_rounded_up() -> None:
    """What factors leave out, and how far states get, are never below their formula in fractions."""
    equal = compared = 0
    for run in (run for run in map(Full, range(40)) if run.items):
        log = SimpleNamespace(time=[0] * SAMPLES, u=run.u.tolist())
        chain = CHECK.Chain(CHECK.Model(run.record()), log, SAMPLES - 1)
        stack, most = run.stacks[0], [max(exactly(ends)) for ends in run.delta]
        left_out = chain._choose(0)[3]
        for (i, j), found in left_out.items():
            exact = sum(d * abs(Fraction(float(item[i, j]))) for d, item in zip(most, stack[1:], strict=True))
            compared, equal = compared + 1, equal + (Fraction(found) == exact)
            assert Fraction(found) >= exact
        known = CHECK.Set([run.x[0].tolist(), run.x[0].tolist()])
        low, high = (row.tolist() for row in (run.w[0], run.w[0]))
        chain.model.bounds = lambda k, low=low, high=high: (None, low, high, None)
        first, second = chain._reach(known, 0, 1)
        for i, found in enumerate(second[: run.n]):
            sizes = [abs(Fraction(float(v))) for v in stack[0][i]]
            sizes = [a + sum(d * abs(Fraction(float(item[i, j]))) for d, item in zip(most, stack[1:], strict=True))
                     for j, a in enumerate(sizes)]  # fmt: skip
            assert Fraction(found) >= sum(a * b for a, b in zip(sizes, exactly(first), strict=True))
    assert compared > 100
    assert equal < compared / 2
