"""Memory of a window: every array by name, one table, one compiled type.

A window holds the samples base .. t. Its variables are the state at the base and v(k) = (w(k), p(k)) of every
sample, p being one scalar a channel of uncertainty; later states are eliminated. All variables are scaled to
[-1, 1] about their centres. Rows and variables of a sample live in ring slots, so that the identity of what stays
survives when the window slides.
"""

from __future__ import annotations

from collections import namedtuple
from typing import Any

import numpy as np
from numba import njit, types
from numba.core import cgutils
from numba.experimental import structref
from numba.extending import intrinsic

FAST = {"nnan", "nsz", "reassoc", "contract"}
UNIT = 1.1102230246251565e-16  # unit roundoff
FLOOR = 2.0**-900  # in normal form: more than underflow can lose
FEASIBILITY = 1e-9  # violation of a scaled row or variable that counts as none
GAP = 1e-9  # between bound and optimum, as a share of the largest cost, that is not worth another factorisation
SMALL_PIVOT = 1e-6
REFACTOR = 60  # pivots between refactorisations
LONG = 250  # pivots after which a program goes on with a cost that is disturbed by
LARGE_JITTER = 1e7  # times the jitter, 1e-4 of the largest cost
PIVOT_LIMIT = 10_000
LARGEST = 2.0**100  # of a state: a window that reaches beyond says nothing any more, and floats would overflow

AT_LOWER, AT_UPPER, BASIC, AT_CENTRE = 0, 1, 2, 3
OPTIMAL, EMPTY, STOPPED = 0, 1, 2
CONSISTENT, EMPTY_CANDIDATE, UNDECIDED = 0, 1, 2

# sizes: n states, nu inputs, nw disturbances, ny sensors, nq channels, nh rows on w, nt template directions,
# na rows on the arrival state besides its box, ni items of a stack, N steps that the window holds at most, of which
# it drops `block` at once, K largest basis, late = 1 if the output depends on w or a channel
Sizes = namedtuple("Sizes", "n nu nw ny nq nh nt na ni N block K late")

BASE, TIME, PENDING, STARTED, PIVOTS, STOPS, PROGRAMS, REFACTORED = range(8)

# Every array of a window: its shape by the letters of `_lengths` (S samples, V slots of variables, Z variables,
# R rows, Q directions, X rows and P columns of a stack, v variables of a slot, J = Z + K).
FLOATS = {
    # the program, and the bound of sum |G| + |bound| of a row
    "G": "RZ", "GT": "ZR", "lower": "R", "upper": "R", "magnitude": "R",
    # rows as they entered, scaled: coefficients of the own state, sum of |own variables|, of |terms in the bounds|,
    # bounds before the state
    "row_x": "Rn", "row_v": "R", "row_c": "R", "raw_lower": "R", "raw_upper": "R", "scale": "R",
    # newest state over z; per sample: state at z = 0, bound of |x|, of the terms that it was computed from, of what
    # v moves in it, and of the rounding error; that error in its frame, and what carries it to the next
    "psi": "nZ", "phi": "Sn", "mag": "Sn", "terms": "Sn", "from_v": "Sn", "err": "Sn", "rho": "Sn", "frame": "Snn",
    "carry": "Snn",
    # per sample: A, the drift at the centres and its magnitude, the columns [E, channels] scaled
    "A": "Snn", "drift": "Sn", "drift_mag": "Sn", "inputs": "Snv",
    # centres and half-widths of v and of the arrival state
    "vc": "Vv", "vr": "Vv", "xc": "n", "xr": "n",
    # template, arrival bounds of T x at the base, the next ones (at base + block) that wait for the slide, and the
    # bounds of T x of the newest state
    "T": "tn", "h_lower": "t", "h_upper": "t", "new_lower": "t", "new_upper": "t", "now_lower": "t", "now_upper": "t",
    # a direction that is asked for, and the bound of the newest state in it
    "query": "n", "answer": "1",
    # data as given, for proofs
    "stack": "SiXP", "u": "Su", "y": "Sy", "noise": "Sy", "slack": "Sy", "w_lower": "Vw", "w_upper": "Vw",
    # channels: stacked uncertainties = gain functional' but for `left`, a bound of the rest times |Delta|, and whether
    # that is not zero; what was known of s, and the two lines over s that bound p
    # (slope, intercept; above, then below)
    "gain": "VqX", "functional": "VqP", "left": "VXP", "is_left": "V", "s_lower": "Vq", "s_upper": "Vq", "lines": "Vq4",
    # fixed: Delta bounds of the channels, rows on w
    "delta": "q2", "w_rows": "hw", "w_rows_lower": "h", "w_rows_upper": "h",
    # one basis inverse a direction; multipliers of an empty window
    "inverse": "QKK", "farkas": "R",
    # tiny fixed change of the cost, against cycling
    "jitter": "Z",
    # scratch of the simplex
    "nu": "K", "d": "Z", "z": "Z", "act": "R", "vio": "R", "alpha": "Z", "wk": "K", "uk": "K", "cost": "Z",
    "true_cost": "Z",     "ratio": "J", "pivot": "J", "drop": "J", "move": "J", "M": "KL", "T2": "KK",
}  # fmt: skip
INTEGERS = {
    "clock": "8", "rows": "QK", "cols": "QK", "k": "Q", "seen_base": "Q", "status": "QZ",
    "candidate": "J", "chosen": "J", "at_upper": "K", "owner": "q",
}  # fmt: skip


def _lengths(size: Sizes) -> dict[str, int]:
    v, r = size.nw + size.nq, size.ny + size.nh + 2 * size.nq
    S, V = size.N + 1, size.N + size.late
    Z, X = size.n + V * v, size.n + size.ny
    return {
        "n": size.n, "u": size.nu, "w": size.nw, "y": size.ny, "q": size.nq, "h": size.nh, "t": size.nt, "i": size.ni,
        "v": v, "S": S, "V": V, "Z": Z, "R": size.na + S * r, "Q": 4 * size.nt + 2 * size.nq + 1, "X": X,
        "P": X - size.ny + size.nu + 1 + size.nw, "K": size.K, "L": size.K + size.n, "J": Z + size.K,
        "1": 1, "2": 2, "4": 4, "8": 8,
    }  # fmt: skip


def allocate(size: Sizes) -> dict[str, Any]:
    """Zeroed arrays of a window, by name."""
    length = _lengths(size)
    tables = ((FLOATS, np.float64), (INTEGERS, np.int64))
    return {k: np.zeros([length[c] for c in shape], dtype=kind) for table, kind in tables for k, shape in table.items()}


@structref.register
class WindowType(types.StructRef):
    """Numba's type of a window: one pointer to named arrays."""


class Window(structref.StructRefProxy):
    """The arrays of a window, as compiled code takes them; `arrays` keeps alive what it borrows."""

    arrays: dict[str, Any]


def _array_type(kind: Any, shape: str) -> Any:
    return types.Array(kind, len(shape), "C")


structref.define_boxing(WindowType, Window)
WINDOW = WindowType(
    [(k, _array_type(types.float64, s)) for k, s in FLOATS.items()]
    + [(k, _array_type(types.int64, s)) for k, s in INTEGERS.items()]
)


@intrinsic
def borrowed(typing_context, array):
    """The same array without its owner, so that compiled code counts no references to it.

    Counting is atomic, and every use of a field of a window counts twice: a fifth of the simplex' time.
    """

    def codegen(context, builder, signature, arguments):
        view = context.make_array(signature.args[0])(context, builder, arguments[0])
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        view.parent = cgutils.get_null_value(view.parent.type)
        return view._getvalue()

    return array(array), codegen


def _constructor_text() -> str:
    """Source of the compiled constructor: it must name every array, so it is written from the tables."""
    names = [*FLOATS, *INTEGERS]
    fill = [f"    w.{k} = borrowed({k})" for k in names]
    return "\n".join([f"def _construct({', '.join(names)}):", "    w = structref.new(WINDOW)", *fill, "    return w"])


# under this file's name and in its globals, so that Numba caches it with the rest
exec(compile(_constructor_text(), __file__, "exec"), globals())
_construct = njit(cache=True)(globals()["_construct"])


def new_window(arrays: dict[str, Any]) -> Any:
    """A window that compiled code can take, over the arrays of `allocate`."""
    window = _construct(*arrays.values())
    window.arrays = arrays
    return window
