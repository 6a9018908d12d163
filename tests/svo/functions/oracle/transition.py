"""A transition: from dx/dt = f(x, w, u) over a box of states to x(T) in A x + a + E w + [-R, R].

Conservative linearisation (Althoff, Stursberg and Buss, CDC 2008) with secants for Jacobians: substep by substep an
enclosure, linear forms over it, an enclosed exponential, and the remainder carried through the integral of exp(M t),
M being the slopes with absolute values off the diagonal: |exp(J t)| <= exp(M t) entry by entry. A state that is too
steep for the last substep short enough has no line in it (`_anywhere`), and is in the remainder of the others.
"""

from __future__ import annotations

import numpy as np

from svo.checks import Array
from svo.functions.tape import Forms
from svo.models.nonlinear import NonlinearModel, Span, Undecided
from svo.models.nonlinear.transition import Transition
from tests.svo.functions.oracle.exponential import carried, held
from tests.svo.functions.oracle.flow import Flow, rates_at_faces

_EPS = float(np.finfo(np.float64).eps)
_FINEST = 4096  # substeps are multiples of so small a part of the sample
_MOST = 200  # substeps
_BEFORE_FLAT = 16  # substeps that states have which no number of substeps would give lines
_TINY = 2.0**-1000
_WORTH_ANOTHER = 0.1  # of the width of the set: a remainder beyond it is worth a second substep


def transition(flow: Flow, start: Span, u: Array, T: float, least: int = 1) -> Transition:
    """Of a continuous plant over a time T, for all states of a box, in at least so many substeps (a power of two).

    Raises
    ------
    Undecided
        If it is not enclosed, or the state may leave the range where the equations hold.
    """
    n, nw = flow.n, len(flow.varying)
    start = flow.inside(start)
    here = Transition(np.eye(n), np.zeros(n), np.zeros((n, nw)), np.zeros(n), start, start, 0)
    done, size, why = 0, _FINEST // least, ""
    while done < _FINEST:
        h = T * (size / _FINEST)  # exact: a power of two
        try:
            box, forms = flow.enclosure(here.box, u, h)
            steep = ~(_scaled_norms(forms.g[:, :n], box, h) <= 1.0)
            pulls = (np.diagonal(forms.g) * T < -_MOST) & (_FINEST // size >= _BEFORE_FLAT)
            is_short = bool((~steep | pulls).all()) or _FINEST // size > _MOST
        except Undecided as error:
            is_short, why = False, str(error)
        if is_short:
            flow.check_valid(box)
            here, done = _after(flow, here, start, box, forms, h, steep), done + size
        elif size == 1 or (_FINEST - done) // size > _MOST:
            raise Undecided(f"more than {_MOST} substeps would be needed: {why}")
        else:
            size //= 2
    return here


def mapped(flow: Flow, start: Span, u: Array) -> Transition:
    """Of a plant in discrete time, x+ = f(x, w, u), for all states of a box.

    Raises
    ------
    Undecided
        As `transition`.
    """
    n, start = flow.n, flow.inside(start)
    flow.check_valid(start)
    forms = flow.forms(start, u)
    c, k = forms.centre, forms.k + 0.5 * (forms.low + forms.high)
    a = k - forms.g @ c
    size = np.abs(forms.k) + np.abs(forms.low) + np.abs(forms.high) + np.abs(forms.g) @ (2.0 * np.abs(c))
    R = 0.5 * (forms.high - forms.low) + (len(c) + 8) * _EPS * size + _TINY
    found = Transition(forms.g[:, :n], a, forms.g[:, n:], R, Span(forms.lower, forms.upper), start, 1)
    return found._replace(box=_newest(flow, found, start, found.box))


def _scaled_norms(J: Array, box: Span, h: float) -> Array:
    """Row sums of |D^-1 J D| h, D being powers of two near what the box and J move within h.

    They decide how short a substep is.
    """
    reach = box.width + 1e-12 * box.largest + 1e-100
    moved = 4.0 * h * (np.abs(J) @ reach)
    unit = np.exp2(np.round(np.log2(reach + moved + 2.0 * h * (np.abs(J) @ moved))))
    sums: Array = np.abs(J) @ unit / unit * h
    return sums


def _after(flow: Flow, here: Transition, start: Span, box: Span, forms: Forms, h: float, steep: Array) -> Transition:
    """One more substep, over which the state stays in ``box``."""
    n, w = flow.n, flow.w
    lined, kept = np.where(steep, 0.0, 1.0), np.where(flow.varying, 0.0, 1.0)
    J, W = forms.g[:, :n] * lined * lined[:, None], forms.g[:, n:] * lined[:, None]
    shift = forms.centre * np.concatenate([lined, kept])  # what varies or is steep stays about its centre
    middle, rest = 0.5 * (forms.low + forms.high), 0.5 * (forms.high - forms.low)
    q = forms.k + middle - forms.g @ shift
    size = np.abs(forms.k) + np.abs(forms.low) + np.abs(forms.high) + np.abs(forms.g) @ np.abs(forms.centre)
    rounding = (n + len(kept) + 8) * _EPS
    free = np.concatenate([(1.0 - lined) * box.width, (1.0 - kept) * w.width])
    moving = np.abs(forms.g) @ (free * 0.5 * (1.0 + _EPS))
    drive, q = lined * (rest + rounding * size + moving), lined * q
    step, most = held(J, h), np.abs(W) @ w.largest + lined * size
    E = step.gain @ (W * kept)
    lost = carried(J, h) @ drive + step.move_error @ box.largest + step.gain_error @ most
    P = np.abs(step.move)
    terms = P @ (np.abs(here.A) @ start.largest + np.abs(here.a) + np.abs(here.E) @ w.largest)
    R = P @ here.R + lost
    R = R + 2.0 * rounding * (terms + np.abs(step.gain) @ most + R) + _TINY
    lowest, highest = np.minimum(here.within.lower, box.lower), np.maximum(here.within.upper, box.upper)
    within = Span(lowest, highest)
    found = Transition(
        step.move @ here.A,
        step.move @ here.a + step.gain @ q,
        step.move @ here.E + E,
        R,
        here.box,
        within,
        here.substeps + 1,
    )
    end = Span(here.box.lower + h * forms.lower, here.box.upper + h * forms.upper)
    room = 2.0 * _EPS * (box.largest + h * np.maximum(np.abs(forms.lower), np.abs(forms.upper)))
    end = Span(end.lower - room, end.upper + room)
    if steep.any():
        found, end = _anywhere(found, steep, _pulled(here.box, box, forms, h, end), end)
    return found._replace(box=_newest(flow, found, start, end))


def _pulled(before: Span, box: Span, forms: Forms, h: float, end: Span) -> Span:
    """Bounds after h of states that are in ``before`` and do not leave ``box``.

    Over the box v = x_i - upper_i has v' <= g_ii v + F, and v <= 0 at first, so for g_ii < 0 and s = -g_ii h
    v(h) <= F (1 - exp(-s)) h / s, where 1 - exp(-s) is between s / (1 + s) and min(s, 1).
    """
    own, at = np.diagonal(forms.g), rates_at_faces(before, forms)
    s = np.where(own < 0.0, -own * h, np.nan)

    def moved(rate: Array) -> Array:
        far = np.where(rate > 0.0, rate * np.minimum(h, h / s), rate * (h / (1.0 + s)))
        return np.where(own < 0.0, far, np.inf)

    up, down = moved(at.upper), moved(-at.lower)
    upper = before.upper + up + 4.0 * _EPS * (np.abs(before.upper) + np.abs(up)) + _TINY
    lower = before.lower - down - 4.0 * _EPS * (np.abs(before.lower) + np.abs(down)) - _TINY
    lower = np.maximum(np.maximum(lower, end.lower), box.lower)
    return Span(lower, np.minimum(np.minimum(upper, end.upper), box.upper))


def _anywhere(found: Transition, steep: Array, at: Span, end: Span) -> tuple[Transition, Span]:
    """States that are anywhere in their bounds ``at`` the end of a substep, whatever they were before."""
    middle = 0.5 * at.lower + 0.5 * at.upper
    radius = 0.5 * at.width + 2.0 * _EPS * at.largest + _TINY
    line = np.where(steep, 0.0, 1.0)[:, None]
    found = found._replace(
        A=found.A * line, E=found.E * line, a=np.where(steep, middle, found.a), R=np.where(steep, radius, found.R)
    )
    return found, Span(np.where(steep, at.lower, end.lower), np.where(steep, at.upper, end.upper))


def _newest(flow: Flow, found: Transition, start: Span, known: Span) -> Span:
    """Bounds of x+: what a transition says, what is known besides, and what is physical."""
    w = flow.w
    y = found.A @ (0.5 * start.lower + 0.5 * start.upper) + found.a + found.E @ (0.5 * (w.lower + w.upper))
    spread = np.abs(found.A) @ (0.5 * start.width) + np.abs(found.E) @ (0.5 * w.width) + found.R
    terms = np.abs(found.A) @ start.largest + np.abs(found.a) + np.abs(found.E) @ w.largest + spread
    spread = spread + 2.0 * (flow.n + len(w.lower) + 8) * _EPS * terms
    box = flow.inside(Span(np.maximum(y - spread, known.lower), np.minimum(y + spread, known.upper)))
    meets = box.lower <= box.upper
    if not meets.all():
        raise Undecided(f"no {flow.states[int(np.argmin(meets))]} of the set stays within the physical range")
    return box


def of_model(model: NonlinearModel, lower: Array, upper: Array, u: Array, T: float) -> Transition:
    """What `model.transition` answers."""
    flow, start = Flow(model.flow), Span(lower, upper)
    if not model.continuous:
        return mapped(flow, start, u)
    found = transition(flow, start, u, T)
    if found.substeps == 1 and (found.R - _WORTH_ANOTHER * found.box.width > 0.0).any():
        finer = transition(flow, start, u, T, least=2)
        found = finer if (finer.R <= found.R).all() else found
    return found
