"""The core's window (`core/window`): its block of memory with every array by name, and the calls on it.

The observers and their proofs use it, nothing outside `svo.observers`. A call takes the block by its address and finds
everything there: what it is given of a sample was written to the arrays ``in_*`` before, a direction to ``query``.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polytopes import native
from polytopes.native import Address, Integer, Real
from svo.checks import Array

LARGEST = 2.0**100  # of a state: a window that reaches beyond says nothing any more
UNLIMITED = 1 << 60  # pivots of a program
ALL = 1 << 60  # programs: more than any task has

# As in `core/window/window.h`.
CONSISTENT, EMPTY_CANDIDATE, UNDECIDED, FULL = range(4)
ARRIVAL, NEWEST, CHANNELS, QUERY = range(4)
FINE, SIGN_OPEN, BAD_INPUT, BAD_OUTPUT, BAD_MATRIX, RANK_ROSE, OUTGROWN = range(7)
BASE, TIME, PENDING, STARTED, PIVOTS, STOPS, PROGRAMS, REFACTORED, CAPPED, STAGE, NEXT = range(11)

_BREAKPOINT = [("ratio", np.float64), ("size", np.float64), ("drop", np.float64), ("who", np.int64)]
_KINDS = [np.dtype(np.float64), np.dtype(np.int64), np.dtype(_BREAKPOINT)]
_ALIGNMENT = 64


class Sizes(NamedTuple):
    """Of a window: n states, nu inputs, nw disturbances, ny sensors, nq channels, nh rows on w, nt template directions,
    na rows on the arrival state besides its box, ni items of a stack, N steps that it holds at most, of which it drops
    `block` at once, K largest basis, late = 1 if the output depends on w or a channel."""

    n: int
    nu: int
    nw: int
    ny: int
    nq: int
    nh: int
    nt: int
    na: int
    ni: int
    N: int
    block: int
    K: int
    late: int


_layout = native.function("fdi_window_layout", Address, Address, returns=Integer)
_enter = native.function("fdi_window_enter", Address, returns=Integer)
_move = native.function("fdi_window_move", Address, returns=Integer)
_complete = native.function("fdi_window_complete", Address, Real, returns=Integer)
_take = native.function("fdi_window_take", Address, Real, Integer, returns=Integer)
_take_sample = native.function("fdi_window_take_sample", *[Address] * 8, Real, Integer, returns=Integer)
_follow = native.function(
    "fdi_window_follow", Address, Integer, Integer, *[Address] * 7, Real, Integer, Address, Address, returns=Integer
)
_solve = native.function("fdi_window_solve", Address, Integer, Integer, Integer, Integer, returns=Integer)
_arrival_programs = native.function("fdi_window_arrival_programs", Address, Address)
_initialise = native.function("fdi_window_initialise", Address, Integer, Address, Address, Address)
_add_late = native.function("fdi_window_add_late", Address, Integer, Real)
_redraw_channel = native.function("fdi_window_redraw_channel", Address, Integer, Integer, Real, Real)
_channel_factors = native.function(
    "fdi_channel_factors", *[Integer] * 4, *[Address] * 7, returns=Integer
)  # fmt: skip
_turn_frame = native.function("fdi_turn_frame", Integer, *[Address] * 5)
_carry_error = native.function("fdi_carry_error", Integer, *[Address] * 5)
_error_of = native.function("fdi_error_of", Integer, Address, Address, Integer, returns=Real)
_NAMES = native.function("fdi_window_arrays", returns=ctypes.c_char_p)().decode().split()


class Block:
    """The memory of a window: one block, zeroed at first, with a view of every array.

    Copies and pickles are copies of its bytes.

    Attributes
    ----------
    size : Sizes
    address : int
        What the calls take.
    arrays : dict of str to array
    kept : tuple of str
        Names of the arrays that make up a window; the others hold nothing between calls.
    """

    def __init__(self, size: Sizes, content: bytes | None = None) -> None:
        self.size = size
        sizes, table = np.array(size, dtype=np.int64), np.zeros((len(_NAMES), 8), dtype=np.int64)
        count = _layout(native.address(sizes), native.address(table))
        room = np.zeros(count + _ALIGNMENT, dtype=np.uint8)
        start = -native.address(room) % _ALIGNMENT
        self._bytes = room[start : start + count]
        self._bytes[: sizes.nbytes] = sizes.view(np.uint8)
        if content is not None:
            self._bytes[:] = np.frombuffer(content, dtype=np.uint8)
        self.address = native.address(self._bytes)
        self.arrays: dict[str, NDArray[Any]] = {}
        for name, (_, kind, dimensions, *lengths, offset) in zip(_NAMES, table.tolist(), strict=True):
            shape, entry = lengths[:dimensions], _KINDS[kind]
            part = self._bytes[offset : offset + entry.itemsize * math.prod(shape)]
            self.arrays[name] = part.view(entry).reshape(shape)
        self.kept = tuple(name for name, kept in zip(_NAMES, table[:, 0], strict=True) if kept)

    def __reduce__(self) -> tuple[Any, ...]:
        return Block, (self.size, self._bytes.tobytes())


def allocate(size: Sizes) -> Block:
    """The block of a window; MemoryError where the machine has no room for it."""
    return Block(size)


def initialise(address: int, rows: Array, lower: Array, upper: Array) -> None:
    """Anchor an empty window at the arrival bounds h, with extra rows (k, n) on the first state."""
    given = [native.floats(a) for a in (rows, lower, upper)]
    _initialise(address, len(rows), *(native.address(a) for a in given))


def take(address: int, eps: float, limit: int) -> tuple[int, int, int]:
    """A whole sample in one call: `enter`, `move`, `complete`, CHANNELS where signs are open, and ARRIVAL.

    Returns what `enter` returns, or OUTGROWN; the verdict; the program that found the window empty, or -1. If the
    verdict is FULL the sample is half done: it goes on with the next call, once the window is in a block of larger K.
    """
    return told(_take(address, eps, limit))


def take_sample(address: int, sample: Iterable[Array], eps: float, limit: int) -> tuple[int, int, int]:
    """`take` of a sample that is given with the call.

    Parameters
    ----------
    sample : iterable of arrays
        Floats in normal form: u, u_next (nu,), y (ny,); stack (ni, n + ny, n + nu + 1 + nw), noise (ny,), w_lower and
        w_upper (nw,).
    """
    return told(_take_sample(address, *[array.tobytes() for array in sample], eps, limit))


def told(found: int) -> tuple[int, int, int]:
    """What is in the one number that the core tells of a sample: code, verdict, program."""
    return found & 7, found >> 3 & 3, (found >> 5) - 1


def follow(
    address: int, samples: tuple[Array, ...], eps: float, limit: int, boxes: Array | None
) -> tuple[int, tuple[int, int, int]]:
    """Samples of a log in turn, until one is not simply consistent, of which the caller concludes the rest.

    Parameters
    ----------
    address : int
    samples : tuple of arrays
        C-contiguous floats in normal form: u, u_next (k, nu), y (k, ny); stack (k, ...) or (1, ...), noise, w_lower and
        w_upper likewise.
    eps, limit
        As of `take`.
    boxes : (k, 2, n) array, optional
        Filled with the boxes of the samples that are consistent.

    Returns
    -------
    How many those are, and what `take` says of the last sample that was taken.
    """
    result, to_boxes = np.zeros(1, dtype=np.int64), None if boxes is None else native.address(boxes)
    addresses = [native.address(array) for array in samples]
    count, is_scheduled = len(samples[0]), len(samples[3]) > 1
    done = _follow(address, count, is_scheduled, *addresses, eps, limit, to_boxes, native.address(result))
    return int(done), told(int(result[0]))


def enter(address: int) -> int:
    """Take the data of a sample: its transition from the newest one, and its measurement.

    Returns FINE, SIGN_OPEN (solve CHANNELS, of those that do not reach the output, before `move`), or an error that
    leaves the window as it was.
    """
    return int(_enter(address))


def move(address: int) -> int:
    """The transition to the sample that `enter` took, with all that drives it.

    Returns FINE or SIGN_OPEN (solve CHANNELS, of those that reach the output, before `complete`).
    """
    return int(_move(address))


def complete(address: int, eps: float) -> bool:
    """Write the rows of the sample that `move` went to; False if the window has outgrown all bounds."""
    return bool(_complete(address, eps))


def solve(address: int, task: int, start: int, stop: int, limit: int) -> tuple[int, int]:
    """The programs of a task, numbers `start` to `stop` - 1: two a direction, upper bound first.

    ARRIVAL decides emptiness and, before a slide, bounds the state at base + block; NEWEST bounds the newest state in
    the template's directions, QUERY in the one that was asked for; CHANNELS tightens the bounds of s that leave its
    sign open. Returns the verdict, and the program that found the window empty or needs a basis larger than K (FULL),
    or -1.
    """
    found = _solve(address, task, start, stop, limit)
    return found & 3, (found >> 2) - 1


def arrival_programs(address: int) -> range:
    """The arrival programs that the newest sample calls for."""
    ends = np.zeros(2, dtype=np.int64)
    _arrival_programs(address, native.address(ends))
    return range(*ends.tolist())


def add_late(address: int, k: int, eps: float) -> None:
    """Rows of the sensors in ``in_y`` that are not NaN, at sample k of the window; they must have been missing."""
    _add_late(address, k, eps)


def redraw_channel(address: int, k: int, q: int, low: float, high: float) -> None:
    """The rows of channel q at sample k for s in [low, high], within its bounds; the box of p stays."""
    _redraw_channel(address, k, q, low, high)


def channel_factors(stack: Array, owner: NDArray[np.int64], delta: Array) -> tuple[Array, Array, Array, bool]:
    """Channels of the uncertainties of a stack in normal form, as the window uses them.

    Parameters
    ----------
    stack : (ni, n + ny, n + nu + 1 + nw) array
    owner : (nq,) array
        Item of each channel.
    delta : (nq, 2) array

    Returns
    -------
    gain, functional : (nq, n + ny), (nq, n + nu + 1 + nw) arrays
    left : (n + ny, n + nu + 1 + nw) array
        Bound of what the channels leave out of all uncertainties together, times |Delta|, entry by entry.
    complete : bool
        Whether that is next to nothing.
    """
    stack, delta, owner = native.floats(stack), native.floats(delta), native.integers(owner)
    nq, (items, rows, columns) = len(owner), stack.shape
    gain, functional = np.zeros((nq, rows)), np.zeros((nq, columns))
    left, scratch = np.zeros((rows, columns)), np.zeros((rows, columns))
    arrays = (stack, owner, delta, gain, functional, left, scratch)
    complete = _channel_factors(items, rows, columns, nq, *(native.address(a) for a in arrays))
    return gain, functional, left, bool(complete)


def channel_count(item: Array) -> int:
    """How many channels an uncertainty (n + ny, n + nu + 1 + nw) takes."""
    most = min(item.shape)
    stack, owner = np.stack([item, item]), np.ones(most, dtype=np.int64)
    gain, *_ = channel_factors(stack, owner, np.ones((most, 2)))
    return int(np.count_nonzero(gain.any(axis=1)))


def turn_frame(A: Array, frame: Array) -> tuple[Array, Array]:
    """The next frame Q' of the rounding error, for the present frame Q (n, n), and a bound of |Q'^-1 A Q|."""
    n, A, frame = len(A), native.floats(A), native.floats(frame)
    turned, carry, scratch = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n + 2, n))
    _turn_frame(n, *(native.address(a) for a in (A, frame, turned, carry, scratch)))
    return turned, carry


def carry_error(carry: Array, turned: Array, rho: Array, fresh: Array) -> Array:
    """Bounds (n,) of the next error in its frame, from those of the present one and the rounding ``fresh`` (n,)."""
    arrays = (*(native.floats(a) for a in (carry, turned, rho, fresh)), found := np.zeros(len(rho)))
    _carry_error(len(rho), *(native.address(a) for a in arrays))
    return found


def error_of(turned: Array, rho: Array, i: int) -> float:
    """Bound of entry i of the error."""
    turned, rho = native.floats(turned), native.floats(rho)
    return float(_error_of(len(rho), native.address(turned), native.address(rho), i))
