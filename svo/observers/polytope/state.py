"""The memory of a polytope observer as named arrays, and back."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from polytopes import Certificate, HPolytope
from svo.observers.answers import VerdictName
from svo.observers.polytope.certificate import AnyCertificate, PolytopeCertificate, PublishedCertificate
from svo.observers.polytope.sets import Outcome, Sample
from svo.observers.saved_state import arrays_of, read_arrays

State = dict[str, NDArray]
VERDICTS: tuple[VerdictName, ...] = ("consistent", "falsified", "undecided")


def write_sample(name: str, sample: Sample) -> State:
    """The data of a sample."""
    state: State = {f"{name}.{part}": getattr(sample, part).copy() for part in ("stack", "noise", "u", "y")}
    state[f"{name}.number"] = np.array(sample.number)
    state[f"{name}.w_box"] = np.array(sample.w_box)
    return state if sample.disturbances is None else state | arrays_of(f"{name}.w", sample.disturbances)


def read_sample(state: Mapping[str, NDArray], name: str) -> Sample:
    disturbances = read_arrays(HPolytope, f"{name}.w", state) if f"{name}.w.A" in state else None
    stack, noise, u, y = (np.array(state[f"{name}.{part}"]) for part in ("stack", "noise", "u", "y"))
    w_lower, w_upper = np.array(state[f"{name}.w_box"])
    return Sample(int(state[f"{name}.number"]), stack, disturbances, noise, u, y, (w_lower, w_upper))


def write_outcome(name: str, outcome: Outcome) -> State:
    """An answer with all that it keeps for the next."""
    state: State = {f"{name}.verdict": np.array(VERDICTS.index(outcome.verdict))}
    state |= arrays_of(f"{name}.joint", outcome.joint)
    state |= _write_groups(f"{name}.memory", outcome.memory)
    state[f"{name}.proofs"] = np.array([len(group) for group in outcome.proofs], dtype=np.int64)
    for i, group in enumerate(outcome.proofs):
        for j, proof in enumerate(group):
            state |= _write_proof(f"{name}.proofs.{i}.{j}", proof)
    return state | _write_certificate(f"{name}.certificate", outcome.certificate)


def read_outcome(state: Mapping[str, NDArray], name: str) -> Outcome:
    """What `write_outcome` wrote; ValueError if it claims a falsification that its certificate does not prove."""
    verdict, certificate = VERDICTS[int(state[f"{name}.verdict"])], _read_certificate(state, f"{name}.certificate")
    if verdict == "falsified" and (certificate is None or not certificate.verify()):
        raise ValueError("its falsification cannot be proven again")
    return Outcome(
        verdict,
        certificate,
        read_arrays(HPolytope, f"{name}.joint", state),
        _read_groups(state, f"{name}.memory"),
        tuple(
            tuple(_read_proof(state, f"{name}.proofs.{i}.{j}") for j in range(count))
            for i, count in enumerate(state[f"{name}.proofs"])
        ),
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


def _read_groups(state: Mapping[str, NDArray], name: str) -> tuple[tuple[HPolytope, ...], ...]:
    return tuple(
        tuple(read_arrays(HPolytope, f"{name}.{i}.{j}", state) for j in range(count))
        for i, count in enumerate(state[name])
    )


def _write_proof(name: str, proof: PolytopeCertificate) -> State:
    state: State = {f"{name}.sample": np.array(proof.sample)}
    state[f"{name}.multipliers"] = np.array(json.dumps(proof.multipliers.to_dict()))
    return state | arrays_of(f"{name}.rows", proof.measurement) | _write_groups(f"{name}.before", [proof.before])


def _read_proof(state: Mapping[str, NDArray], name: str) -> PolytopeCertificate:
    multipliers = Certificate.from_dict(json.loads(str(state[f"{name}.multipliers"])))
    (before,) = _read_groups(state, f"{name}.before")
    return PolytopeCertificate(
        int(state[f"{name}.sample"]), before, read_arrays(HPolytope, f"{name}.rows", state), multipliers
    )


def _write_certificate(name: str, certificate: AnyCertificate | None) -> State:
    if certificate is None:
        return {}
    published = isinstance(certificate, PublishedCertificate)
    proofs = certificate.stacks if isinstance(certificate, PublishedCertificate) else (certificate,)
    state: State = {name: np.array([published, certificate.sample, len(proofs)], dtype=np.int64)}
    for i, proof in enumerate(proofs):
        state |= _write_proof(f"{name}.{i}", proof)
    return state


def _read_certificate(state: Mapping[str, NDArray], name: str) -> AnyCertificate | None:
    if name not in state:
        return None
    published, sample, count = (int(v) for v in state[name])
    proofs = tuple(_read_proof(state, f"{name}.{i}") for i in range(count))
    return PublishedCertificate(sample, proofs) if published else proofs[0]
