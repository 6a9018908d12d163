"""Boxes that a state keeps to within a substep, stated so large that whoever computes otherwise finds them to hold."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from svo.checks import Array
from svo.functions.tape import Unenclosed
from svo.models.nonlinear import NonlinearModel, Undecided
from svo.models.state_range import within

PARTS = 4096  # of a sample: what substeps are counted in
_ROOMS = (0.002, 0.005, 0.02, 0.1)  # of what a trajectory moves: what a box is larger by at first
_OTHERWISE = 0.01  # of what an end of the set moves within a substep: how much wider another's next one may begin
_TRIALS = 12  # of ever larger boxes
_MARGIN = 0.1  # of the room: at least so much of it is left
_ROUNDED = 1e-13  # of the terms of a sum in floats: more than it rounds


def hinted(model: NonlinearModel, boxes: Array, u: Array, h: Sequence[float]) -> Array:
    """Boxes (substeps, 2, n) around those of a path (`PlantKernel.path`) whose substeps take h seconds.

    The plant makes of each, within that time, a box in its interior.

    Raises
    ------
    Undecided
        If one of them is not found.
    """
    found, wider, last = [], np.zeros((2, model.n_states)), boxes[0, 0]
    for (before, box), seconds in zip(boxes, h, strict=True):
        wider = wider + _OTHERWISE * np.abs(before - last)
        start = np.array(within(model.physical_range, before[0] - wider[0], before[1] + wider[1]))
        found.append(_grown(model, start, box, u, seconds))
        last = before
    return np.array(found)


def _grown(model: NonlinearModel, before: Array, box: Array, u: Array, h: float) -> Array:
    """The one of those that are tried of which the plant makes least."""
    wide = box[1] - box[0]
    least, best = np.inf, None
    for share in _ROOMS:
        found = _held(model, before, box, u, h, share)
        if found is None:
            continue
        hint, image = found
        left = np.minimum(hint[1], image[1]) - np.maximum(hint[0], image[0])
        more = float(((left - wide) / (wide + 1e-200)).max())
        if more < least:
            least, best = more, hint
    if best is None:
        raise Undecided("no box was found that is plainly one that the state keeps to")
    return best


def _held(
    model: NonlinearModel, before: Array, box: Array, u: Array, h: float, share: float
) -> tuple[Array, Array] | None:
    """A box with room for a share of what a trajectory moves, or more, and what the plant makes of it."""
    wide = box[1] - box[0]
    moved = np.maximum(wide - (before[1] - before[0]), 0.0)
    room = share * moved + 1e-9 * wide + 1e-13 * np.abs(box).max(axis=0) + 1e-200
    for trial in range(_TRIALS):
        box = np.array(within(model.physical_range, box[0] - room, box[1] + room))
        image = _image(model, before, box, u, h)
        if image is None:
            return None
        if _is_inside(model, image, box, _MARGIN * room):
            return box, image
        box = np.array([np.minimum(box[0], image[0]), np.maximum(box[1], image[1])])
        room = room + 0.1 * trial * np.maximum(box[1] - box[0] - wide, 0.0)
    return None


def _is_inside(model: NonlinearModel, image: Array, box: Array, margin: Array) -> bool:
    """But for faces of the physical range."""
    low, high = image[0] - margin > box[0], image[1] + margin < box[1]
    physical = model.physical_range
    if physical is not None:
        low, high = low | (box[0] <= physical.lower), high | (box[1] >= physical.upper)
    return bool((low & high).all())


def _image(model: NonlinearModel, before: Array, box: Array, u: Array, h: float) -> Array | None:
    """before + [0, h] f, as `docs/proof_format.md` has it; None where f has no bounds."""
    flow, n = model.flow, model.n_states
    lower, upper = (np.concatenate([end, w, u]) for end, w in zip(box, flow.w, strict=True))
    try:
        f = flow.tape.forms(lower, upper, free=n + len(flow.varying))
    except Unenclosed:
        return None
    own, radius = np.diagonal(f.g[:, :n]), 0.5 * (upper - lower)[: f.g.shape[1]]
    others = np.abs(f.g) @ radius - np.abs(own) * radius[:n]
    lost = _ROUNDED * (np.abs(f.k) + np.abs(f.g) @ radius + np.abs(f.low) + np.abs(f.high))
    at_low = f.k + own * (before[0] - f.centre[:n]) - others + f.low - lost
    at_high = f.k + own * (before[1] - f.centre[:n]) + others + f.high + lost
    low = np.where(own <= 0.0, np.maximum(at_low, f.lower), f.lower)
    high = np.where(own <= 0.0, np.minimum(at_high, f.upper), f.upper)
    return np.array([before[0] + h * np.minimum(low, 0.0), before[1] + h * np.maximum(high, 0.0)])
