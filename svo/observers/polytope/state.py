"""The memory of a polytope observer as named arrays, and back."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope
from svo.models import UncertainModel
from svo.observers.answers import VerdictName
from svo.observers.polytope.certificate import PolytopeCertificate, PublishedCertificate
from svo.observers.polytope.sets import Outcome, Sample
from svo.observers.saved_state import arrays_of, numbers, read_arrays, sample_shapes
from svo.store.values import decode_value, encode_value

State = dict[str, NDArray]
VERDICTS: tuple[VerdictName, ...] = ("consistent", "falsified", "undecided")


def write_sample(name: str, sample: Sample) -> State:
    """The data of a sample."""
    state: State = {f"{name}.{part}": getattr(sample, part).copy() for part in ("stack", "noise", "u", "y")}
    state[f"{name}.number"] = np.array(sample.number)
    state[f"{name}.w_box"] = np.array(sample.w_box)
    return state if sample.disturbances is None else state | arrays_of(f"{name}.w", sample.disturbances)


def read_sample(state: Mapping[str, NDArray], name: str, model: UncertainModel) -> Sample:
    """What `write_sample` wrote of a sample of this model; ValueError if the shapes are others."""
    shapes = sample_shapes(model)
    stack, noise, u, y, (w_lower, w_upper) = (
        numbers(state, f"{name}.{part}", *shapes[part], missing=part == "y")
        for part in ("stack", "noise", "u", "y", "w_box")
    )
    disturbances = _read_set(state, f"{name}.w", model.n_disturbances) if model.n_disturbances else None
    return Sample(int(state[f"{name}.number"]), stack, disturbances, noise, u, y, (w_lower, w_upper))


def write_outcome(name: str, outcome: Outcome) -> State:
    """An answer with all that it keeps for the next."""
    state: State = {f"{name}.verdict": np.array(VERDICTS.index(outcome.verdict))}
    state |= arrays_of(f"{name}.joint", outcome.joint)
    state |= _write_groups(f"{name}.memory", outcome.memory)
    published = isinstance(outcome.certificate, PublishedCertificate)
    state[f"{name}.proofs"] = np.array(json.dumps(encode_value((published, outcome.certificate, outcome.proofs))))
    return state


def read_outcome(state: Mapping[str, NDArray], name: str, model: UncertainModel) -> Outcome:
    """What `write_outcome` wrote; ValueError if it claims a falsification that its certificate does not prove."""
    n = model.n_states
    verdict = VERDICTS[int(state[f"{name}.verdict"])]
    published, record, proofs = json.loads(str(state[f"{name}.proofs"]))
    kind = PublishedCertificate if published else PolytopeCertificate
    certificate = None if record is None else decode_value(kind, record)
    if verdict == "falsified" and (certificate is None or not certificate.verify()):
        raise ValueError("its falsification cannot be proven again")
    joint = _read_set(state, f"{name}.joint", n, n + model.n_disturbances)
    memory = _read_groups(state, f"{name}.memory", n)
    return Outcome(
        verdict, certificate, joint, memory, decode_value(tuple[tuple[PolytopeCertificate, ...], ...], proofs)
    )


def _write_groups(name: str, groups: Iterable[Iterable[HPolytope]]) -> State:
    state: State = {}
    counts = []
    for i, group in enumerate(groups):
        sets = tuple(group)
        counts.append(len(sets))
        for j, P in enumerate(sets):
            state |= arrays_of(f"{name}.{i}.{j}", P)
    return state | {name: np.array(counts, dtype=np.int64)}


def _read_set(state: Mapping[str, NDArray], name: str, *dims: int) -> HPolytope:
    """A nonempty set in one of these dimensions."""
    P = read_arrays(HPolytope, name, state)
    if P.dim not in dims or P.emptiness().status == "empty":
        raise ValueError(f"{name} is {P}; expected a nonempty set in dimension {' or '.join(map(str, dims))}")
    return P


def _read_groups(state: Mapping[str, NDArray], name: str, n: int) -> tuple[tuple[HPolytope, ...], ...]:
    return tuple(
        tuple(_read_set(state, f"{name}.{i}.{j}", n) for j in range(count)) for i, count in enumerate(state[name])
    )
