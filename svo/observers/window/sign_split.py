"""Programs of a window split by the signs of its channels' s, where the convex hull of p = Delta s is not exact.

For s in [l, r] with l < 0 < r the hull of {(s, Delta s)} holds points that no Delta explains. Each of the cells s >= 0
and s <= 0 is exact, so the maximum over both is that of the true, nonconvex set. Cells are split best first, only
where the maximiser of a program needs a p that is no Delta s; every bound so far is an outer one, so the search may
stop at any number of cells.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from svo.checks import Array
from svo.observers import window_kernel as kernel
from svo.observers.window.certificate import OnWindow, WindowCertificate
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.memory import Memory

Cell = dict[tuple[int, int], tuple[float, float]]  # (sample, channel): bounds of its s
_CHANGED = ("G", "GT", "row_x", "row_v", "row_c", "raw_lower", "raw_upper", "scale", "magnitude", "lower", "upper",
            "s_lower", "s_upper", "lines")  # fmt: skip
_INEXACT = 1e-9  # of the half-width of p, by which p may miss Delta s


@dataclass(frozen=True, eq=False)
class SplitCertificate(OnWindow):
    """Proof that a window is empty whatever the signs of its s: one certificate a cell, and the cells cover all.

    Its ``samples`` have the bounds of s and the multipliers of the first cell.

    Attributes
    ----------
    cells : tuple of WindowCertificate
        The same window and data, with bounds of s that differ.
    s_lower, s_upper : (samples, nq) arrays
        Bounds of every s that the cells must cover; conditional as in `WindowCertificate`.
    """

    kind = "window split by signs"

    cells: tuple[WindowCertificate, ...]
    s_lower: Array
    s_upper: Array

    @property
    def first(self) -> int:
        return self.cells[0].first

    @property
    def last(self) -> int:
        return self.cells[0].last

    @property
    def n(self) -> int:
        return self.cells[0].n

    def verify(self) -> bool:
        """Check every cell in exact arithmetic, that all have the same data, and that none is missing."""
        if not self.cells or not all(cell.verify() for cell in self.cells):
            return False
        if not all(_same_window(self.cells[0], cell) for cell in self.cells[1:]):
            return False
        boxes = [(np.array([s.s_lower for s in c.samples]), np.array([s.s_upper for s in c.samples]))
                 for c in self.cells]  # fmt: skip
        shape = boxes[0][0].shape
        if self.s_lower.shape != shape or self.s_upper.shape != shape:
            return False
        return _cover(self.s_lower, self.s_upper, boxes)

    def resting_on(self, largest_at: int | None) -> SplitCertificate:
        """As `WindowCertificate.resting_on`, in every cell."""
        return replace(self, cells=tuple(cell.resting_on(largest_at) for cell in self.cells))

    def about(self) -> WindowCertificate:
        return self.cells[0]


def _same_window(a: WindowCertificate, b: WindowCertificate) -> bool:
    own = ("first", "last", "n", "late", "largest_at", "delta", "owner", "w_rows", "w_rows_lower", "w_rows_upper")
    data = ("stack", "u", "y", "noise", "slack", "w_lower", "w_upper")
    if not (_same_s(a, b) and a.sums is None and b.sums is None):
        return False
    pairs = [(getattr(a, name), getattr(b, name)) for name in own]
    pairs += [(getattr(a.arrival, name), getattr(b.arrival, name)) for name in ArrivalSet.__dataclass_fields__]
    pairs += [(getattr(s, d), getattr(t, d)) for s, t in zip(a.samples, b.samples, strict=True) for d in data]
    return all(np.array_equal(p, q, equal_nan=np.asarray(p).dtype.kind == "f") for p, q in pairs)


def _same_s(a: WindowCertificate, b: WindowCertificate) -> bool:
    """Whether the s of both are the same functions of the samples, as cells of their signs must be."""
    if (a.units is None) != (b.units is None):
        return False
    if a.units is not None and b.units is not None and not np.array_equal(a.units.factor, b.units.factor):
        return False
    for s, t in zip(a.samples, b.samples, strict=True):
        for name in ("functional", "gain", "remainder"):
            p, q = getattr(s, name), getattr(t, name)
            if (p is None) != (q is None) or (p is not None and not np.array_equal(p, q)):
                return False
    return True


def _cover(lower: Array, upper: Array, boxes: list[tuple[Array, Array]]) -> bool:
    """Whether boxes cover lower <= s <= upper, by halving it where one of them ends inside."""
    if any((low <= lower).all() and (upper <= high).all() for low, high in boxes):
        return True
    for low, high in boxes:
        for ends in (low, high):
            inside = np.argwhere((lower < ends) & (ends < upper))
            if len(inside):
                at = tuple(inside[0])
                below, above = upper.copy(), lower.copy()
                below[at] = above[at] = ends[at]
                parts = ((lower, below), (above, upper))
                return all(_cover(*part, [b for b in boxes if _meet(*part, *b)]) for part in parts)
    return False


def _meet(lower: Array, upper: Array, low: Array, high: Array) -> bool:
    """Whether two boxes share a point; touching is enough."""
    return bool((np.maximum(lower, low) <= np.minimum(upper, high)).all())


@dataclass(frozen=True)
class SplitResult:
    """Maximum over the cells, whether one of them surely has a point, and the proof if none has (then -inf)."""

    value: float
    has_point: bool
    proof: SplitCertificate | None


class SplitPrograms:
    """The programs of a window whose cells are told apart; restores the window's rows when it is left.

    Parameters
    ----------
    memory : Memory
    certificate : callable
        The certificate of the window as it stands.
    limit : int
        Largest number of cells that a program may have.
    """

    def __init__(self, memory: Memory, certificate: Callable[[], WindowCertificate], limit: int) -> None:
        self._memory, self._size = memory, memory.size
        self._certificate, self._limit = certificate, limit
        self._open = dict(self._open_channels())
        self._saved = {name: self._memory.arrays[name].copy() for name in _CHANGED}
        slots = [k % (self._size.N + self._size.late) for k in range(memory.base, memory.time + 1)]
        self._bounds = self._memory.arrays["s_lower"][slots].copy(), self._memory.arrays["s_upper"][slots].copy()

    @property
    def is_needed(self) -> bool:
        """Whether any s in the window may have either sign."""
        return bool(self._open)

    def solve(self, task: int, program: int, bound: Callable[[], float]) -> SplitResult:
        """One program over the cells; ``bound`` reads the upper bound that the kernel found."""
        count, has_point, proofs = 0, False, []
        heap: list[tuple[float, int, Cell, tuple[int, int] | None]] = []
        waiting: list[Cell] = [{}]
        while waiting:
            for cell in waiting:
                verdict, value, branch = self._one(task, program, cell, bound)
                count += 1
                has_point = has_point or verdict == kernel.CONSISTENT
                if verdict == kernel.EMPTY_CANDIDATE:
                    proof = self._certificate()
                    if proof.verify():
                        proofs.append(proof)
                        continue
                heapq.heappush(heap, (-value, count, cell, branch))
            waiting = []
            if heap and heap[0][3] is not None and count < self._limit:
                _, _, cell, (k, q) = heapq.heappop(heap)  # type: ignore[misc]
                low, high = self._open[k, q]
                waiting = [cell | {(k, q): (low, 0.0)}, cell | {(k, q): (0.0, high)}]
        self._apply({})
        self._memory.arrays["seen_base"][:] = -1
        if heap:
            return SplitResult(-heap[0][0], has_point, None)
        return SplitResult(-np.inf, False, SplitCertificate(tuple(proofs), *self._bounds))

    def _one(
        self, task: int, program: int, cell: Cell, bound: Callable[[], float]
    ) -> tuple[int, float, tuple[int, int] | None]:
        self._apply(cell)
        self._memory.arrays["seen_base"][:] = -1  # the bases are those of other rows
        verdict, _ = self._memory.solve(task, program, program + 1, kernel.UNLIMITED)
        branch = self._most_violated(cell) if verdict == kernel.CONSISTENT else self._widest(cell)
        return verdict, bound(), branch

    def _apply(self, cell: Cell) -> None:
        for name, array in self._saved.items():
            self._memory.arrays[name][...] = array
        for (k, q), (low, high) in cell.items():
            kernel.redraw_channel(self._memory.address, k, q, low, high)

    def _open_channels(self) -> Iterator[tuple[tuple[int, int], tuple[float, float]]]:
        arrays, size = self._memory.arrays, self._size
        nr = size.ny + size.nh + 2 * size.nq
        for k in range(int(arrays["clock"][kernel.BASE]), int(arrays["clock"][kernel.TIME]) + size.late):
            v = k % (size.N + size.late)
            rows = arrays["scale"][size.na + (k % (size.N + 1)) * nr + size.ny + size.nh :]
            for q in range(size.nq):
                low, high = float(arrays["s_lower"][v, q]), float(arrays["s_upper"][v, q])
                if low < 0.0 < high and rows[2 * q] != 0.0 and arrays["delta"][q, 0] < arrays["delta"][q, 1]:
                    yield (k, q), (low, high)

    def _widest(self, cell: Cell) -> tuple[int, int] | None:
        """The channel left open whose p is the least certain."""
        left = {at: min(-low, high) for at, (low, high) in self._open.items() if at not in cell}
        return max(left, key=left.__getitem__) if left else None

    def _most_violated(self, cell: Cell) -> tuple[int, int] | None:
        """The open channel whose p at the maximiser misses every Delta s the most; None if none does."""
        arrays, size = self._memory.arrays, self._size
        n, nw, nv, z = size.n, size.nw, size.nw + size.nq, self._memory.arrays["z"]
        x, worst, found = arrays["xc"] + arrays["xr"] * z[:n], _INEXACT, None
        for k in range(int(arrays["clock"][kernel.BASE]), int(arrays["clock"][kernel.TIME]) + 1):
            s, v = k % (size.N + 1), k % (size.N + size.late)
            own = z[n + v * nv : n + (v + 1) * nv]
            values = arrays["vc"][v] + arrays["vr"][v] * own
            for q in range(size.nq):
                if (k, q) in self._open and (k, q) not in cell:
                    value = float(arrays["functional"][v, q] @ np.concatenate([x, arrays["u"][s], [1.0], values[:nw]]))
                    low, high = sorted(d * value for d in arrays["delta"][q])
                    p, width = float(values[nw + q]), float(arrays["vr"][v, nw + q])
                    miss = max(low - p, p - high) / width if width > 0.0 else 0.0
                    if miss > worst:
                        worst, found = miss, (k, q)
            x = arrays["A"][s] @ x + arrays["drift"][s] + arrays["inputs"][s] @ own
        return found
