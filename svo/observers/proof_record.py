"""Proofs as `svo-alarm-3` stores them: without their matrices, and once what is the same at every sample.

See `docs/alarm_format.md`.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from svo.checks import Array
from svo.observers.certificate import Certificate
from svo.observers.polytope.certificate import MeasuredOutput, PolytopeCertificate
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.evidence import WindowSample
from svo.observers.window.sign_split import SplitCertificate
from svo.observers.zonotope.certificate import ZonotopeCertificate
from svo.store.values import check_keys, decode_array, decode_fields, decode_list, encode_value

_MOST_SAMPLES = 2**16  # of a proof
_OF_A_SAMPLE = [f.name for f in fields(WindowSample) if f.name != "stack"]
_MAY_MISS = {f.name for f in fields(WindowSample) if f.default is None}
_ONCE = {"noise", "w_lower", "w_upper", "lines", "gain", "functional", "remainder"}
"""What stands in a record once where it is the same at every sample."""
_OF_A_CELL = {"s_lower", "s_upper", "lines", "on_output", "on_w", "on_channel"}
"""What differs from cell to cell of a window that is split by signs."""

KINDS: dict[str, type[Certificate]] = {
    kind.kind: kind for kind in (WindowCertificate, SplitCertificate, ZonotopeCertificate, PolytopeCertificate)
}
"""The certificates that can be stored, by the name of their kind; those of other observers are stored as they are."""
WITHOUT_MATRICES = frozenset(KINDS)
"""Kinds whose matrices stand in the record beside the proof."""


def stacks_of(proof: Certificate) -> Array:
    """The stacks (samples, items, n + ny, n + nu + 1 + nw) that a proof is about."""
    return np.array([s.stack for s in proof.samples])


def encode_proof(proof: Certificate) -> dict[str, Any]:
    """A proof of one of `KINDS` as JSON can hold it, without its stacks if it is of one `WITHOUT_MATRICES`.

    Raises
    ------
    TypeError
        If it is of another kind, or none about the model.
    """
    match proof:
        case WindowCertificate():
            return _encode_window(proof)
        case SplitCertificate():
            cells = [
                {
                    "samples": [{name: encode_value(getattr(s, name)) for name in _OF_A_CELL} for s in cell.samples],
                    "on_arrival": encode_value(cell.on_arrival),
                }
                for cell in proof.cells
            ]
            ends = {"s_lower": encode_value(proof.s_lower), "s_upper": encode_value(proof.s_upper)}
            return {"window": _encode_window(proof.cells[0]), "cells": cells, **ends}
        case ZonotopeCertificate():
            rest = {name: encode_value(getattr(proof, name)) for name in ("arrival", "multipliers")}
            return rest | {"window": _encode_window(proof.window)}
        case PolytopeCertificate():
            record = proof.to_dict()
            del record["data"]["stack"]
            return record
    if KINDS.get(proof.kind) is not type(proof):
        known = ", ".join(kind.__name__ for kind in KINDS.values())
        raise TypeError(f"certificate is {type(proof).__name__}, which no alarm can store; expected one of {known}")
    return proof.to_dict()


def decode_proof(kind: str, record: Any, stacks: Array) -> Certificate:
    """What `encode_proof` gave, with its ``stacks``: one a sample, or one for all of them.

    Raises
    ------
    ArithmeticError, AttributeError, LookupError, TypeError, ValueError
        If it is none.
    """
    if kind == WindowCertificate.kind:
        return _decode_window(record, stacks)
    if kind == SplitCertificate.kind:
        check_keys(record, {"window", "cells", "s_lower", "s_upper"})
        window = _decode_window(record["window"], stacks)
        cells = tuple(_decode_cell(window, cell) for cell in decode_list(record["cells"]))
        return SplitCertificate(cells, decode_array(record["s_lower"]), decode_array(record["s_upper"]))
    if kind == ZonotopeCertificate.kind:
        parts = decode_fields(ZonotopeCertificate, record, {"window"})
        return ZonotopeCertificate(**parts, window=_decode_window(record["window"], stacks))
    if kind != PolytopeCertificate.kind:
        return KINDS[kind].from_dict(record)
    parts = decode_fields(PolytopeCertificate, record, {"data"})
    measured = decode_fields(MeasuredOutput, record["data"], set(), absent={"stack"})
    if len(stacks) != 1:
        raise ValueError(f"there are {len(stacks)} stacks; expected that of the measured sample")
    return PolytopeCertificate(**parts, data=MeasuredOutput(stack=stacks[0], **measured))


def _encode_window(c: WindowCertificate) -> dict[str, Any]:
    every = {name: getattr(c.samples[0], name) for name in _ONCE if _is_the_same(c.samples, name)}
    samples = [
        {name: encode_value(value) for name in _OF_A_SAMPLE if name not in every
         if (value := getattr(s, name)) is not None}
        for s in c.samples
    ]  # fmt: skip
    once = {name: encode_value(value) for name, value in every.items() if value is not None}
    return encode_value(replace(c, samples=())) | {"samples": samples, "every_sample": once}


def _is_the_same(samples: tuple[WindowSample, ...], name: str) -> bool:
    values = [getattr(s, name) for s in samples]
    return len({None if value is None else value.tobytes() for value in values}) == 1


def _decode_window(record: Any, stacks: Array) -> WindowCertificate:
    record = dict(record)
    samples, every = decode_list(record.get("samples")), record.pop("every_sample", None)
    if len(samples) > _MOST_SAMPLES or len(stacks) not in (1, len(samples)):
        raise ValueError(
            f"it has {len(samples)} samples, {len(stacks)} stacks; expected up to {_MOST_SAMPLES}, one each"
        )
    check_keys(every, _ONCE & set(every))
    once = {name: decode_array(value) for name, value in every.items()}
    parts = decode_fields(WindowCertificate, record, {"samples"})
    decoded = (_decode_sample(s, once, stacks[min(k, len(stacks) - 1)]) for k, s in enumerate(samples))
    return WindowCertificate(**parts, samples=tuple(decoded))


def _decode_sample(record: Any, every: dict[str, Array], stack: Array) -> WindowSample:
    own = decode_fields(WindowSample, record, absent={"stack", *every})
    return WindowSample(**own, **every, stack=stack)


def _decode_cell(window: WindowCertificate, record: Any) -> WindowCertificate:
    check_keys(record, {"samples", "on_arrival"})
    samples = []
    for s, cell in zip(window.samples, decode_list(record["samples"]), strict=True):
        check_keys(cell, _OF_A_CELL)
        samples.append(replace(s, **{name: decode_array(value) for name, value in cell.items()}))
    return replace(window, samples=tuple(samples), on_arrival=decode_array(record["on_arrival"]))
