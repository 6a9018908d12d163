"""The steps of a proof from a first set to a falsification, as they are made: what `docs/proof_format.md` describes.

Everything is in the user's units and about the samples as the observer counts them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from svo.checks import Array
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.window import Window
from svo.store.values import encode_value

SAMPLES = ("sample", "first", "last")
"""Entries of a step that count samples."""


class ProofSteps:
    """Collects the steps of one observer's run since its set was last given.

    Attributes
    ----------
    steps : list of dict
        As JSON can hold them.
    missing : str or None
        Why the steps are no whole proof.
    """

    def __init__(self) -> None:
        self.steps: list[dict[str, Any]] = []
        self.missing: str | None = None
        self._window: Window | None = None
        self._channels: dict[int, bytes] = {}

    def channel(self, window: Window, q: int, side: int, value: float, proof: WindowCertificate) -> None:
        """A bound of s of a channel of the newest sample, upper (0) or lower (1)."""
        self._add(window, "s", proof, sample=proof.last, channel=q, side=_SIDES[side], value=value)

    def arrival(self, window: Window, program: int, sample: int, proof: WindowCertificate) -> None:
        """A bound of the state at a sample: along an axis, or a row of the template."""
        form, arrays = window.settings.form, window.memory.arrays
        row, side = program // 2, program % 2
        value = float(arrays["new_lower" if side else "new_upper"][row])
        unit = form.x[row] if row < len(form.x) else 1.0
        self._add(window, "x", proof, unit, sample=sample, row=row, side=_SIDES[side], value=value * unit)

    def alarm(self, window: Window, proof: WindowCertificate) -> None:
        """The falsification."""
        if proof.arrival.is_unknown:
            self.missing = "its window rests on readings alone, which no step says yet"
        self._add(window, "alarm", proof)

    def _add(self, window: Window, kind: str, proof: WindowCertificate, unit: float = 1.0, **entries: Any) -> None:
        if not np.isfinite(entries.get("value", 0.0)):
            return  # says nothing
        self._begin(window)
        for k, s in enumerate(proof.samples, start=proof.first):
            if s.gain is None or s.functional is None:
                self.missing = "its channels have no factors"
            elif len(s.gain) and self._channels.get(k) != (key := s.gain.tobytes() + s.functional.tobytes()):
                self._channels[k] = key
                factors = {"gain": encode_value(s.gain), "functional": encode_value(s.functional)}
                self.steps.append({"step": "channels", "sample": k, "owner": proof.owner.tolist(), **factors})
        if "value" in entries:
            entries["value"] = float(entries["value"]).hex()
        self.steps.append({"step": kind, **entries, **_multipliers(proof, unit)})

    def _begin(self, window: Window) -> None:
        """A window that was not there before starts from its own set."""
        if window is self._window:
            return
        if window.origin == 0:
            self.steps.clear()
            self._channels.clear()
        if window.free:
            self.missing = "its set started again from readings alone, which no step says yet"
        self._window = window
        form = window.settings.form
        anchor, largest = window.anchor, form.model.start_range
        is_largest = largest is not None and same_box(anchor, ArrivalSet.box(largest.lower, largest.upper))
        self.steps.append({
            "step": "start", "sample": window.origin, "from": "largest" if is_largest else "first",
            "set": encode_set(_in_units(anchor, form.x)), "template": encode_value(window.settings.template / form.x),
        })  # fmt: skip


_SIDES = ("upper", "lower")


def same_box(a: ArrivalSet, b: ArrivalSet) -> bool:
    """Whether two sets are the same in every bit."""
    names = ("box_lower", "box_upper", "rows", "lower", "upper")
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in names)


def encode_set(of: ArrivalSet) -> dict[str, Any]:
    """A set as JSON can hold it."""
    return dict(encode_value(of))


def first_set(window: Window) -> ArrivalSet:
    """What a window's state is known to be in at its first sample, in the user's units."""
    return _in_units(window.anchor, window.settings.form.x)


def _in_units(of: ArrivalSet, x: Array) -> ArrivalSet:
    return ArrivalSet(of.box_lower * x, of.box_upper * x, of.rows / x, of.lower, of.upper)


def _multipliers(c: WindowCertificate, unit: float) -> dict[str, Any]:
    """Those of the rows, times a power of two; of lines only where there is one."""
    where, values = [], []
    for k, s in enumerate(c.samples):
        for q, side in np.argwhere(s.on_channel).tolist():
            where.append([k, q, side])
            values.append([s.on_channel[q, side] * unit, *s.lines[q, 2 * side : 2 * side + 2]])
    found: dict[str, Any] = {
        "first": c.first,
        "last": c.last,
        "on_start": encode_value(c.on_arrival * unit),
        "on_output": encode_value(np.array([s.on_output for s in c.samples]) * unit),
    }
    if len(c.w_rows):
        found["on_w"] = encode_value(np.array([s.on_w for s in c.samples]) * unit)
    if where:
        found |= {"on_line": where, "line": encode_value(np.array(values))}
    return found
