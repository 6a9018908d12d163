"""One sample of the polytope observer: the sound recursion, and equation (3) as it was published."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from polytopes import HPolytope, UndecidedError
from svo.checks import Array
from svo.models import UncertainModel
from svo.observers.answers import VerdictName
from svo.observers.polytope.certificate import (
    AnyCertificate,
    MeasuredOutput,
    PolytopeCertificate,
    PublishedCertificate,
    intersection,
)
from svo.observers.polytope.output_rows import output_rows
from svo.observers.polytope.vertex_images import (
    hull_normals,
    hull_of_images,
    image,
    limited,
    reach_of,
    template,
    widened_rows,
)

Maps = Sequence[tuple[Array, Array]]
_NO_DISTURBANCES = np.zeros(0), np.zeros(0)


class Sample(NamedTuple):
    """Model and data of one sample; ``disturbances`` is None where the model has none, ``w_box`` holds them."""

    number: int
    stack: Array
    disturbances: HPolytope | None
    noise: Array
    u: Array
    y: Array
    w_box: tuple[Array, Array] = _NO_DISTURBANCES

    def joint(self, states: HPolytope) -> HPolytope:
        """The set of (x, w) for x in a set."""
        return states if self.disturbances is None else states.product(self.disturbances)


class Outcome(NamedTuple):
    """Answer at a sample: ``joint`` contains x (and w, where the output depends on it), ``memory`` is for the next."""

    verdict: VerdictName
    certificate: AnyCertificate | None
    joint: HPolytope
    memory: tuple[tuple[HPolytope, ...], ...]
    proofs: tuple[tuple[PolytopeCertificate, ...], ...] = ()


class Recursion(Protocol):
    """A way from sample to sample."""

    def first(self, initial: HPolytope, sample: Sample) -> Outcome:
        """The first measurement."""
        ...

    def next(self, last: Outcome, before: Sample, maps: Maps, sample: Sample) -> Outcome:
        """A transition from sample ``before`` and a measurement."""
        ...


@dataclass(frozen=True)
class SoundRecursion:
    """Hulls over the vertices of Delta of m-step images without measurements, m = 1..N, then the measurement.

    Images of m steps are made from the hull of those of m - 1: affine maps and sums commute with convex hulls, so that
    the hull over all 2^(m n_Delta) vertices costs 2^n_Delta images. Exact one-step images already lie in those of
    more steps (their set lies in the image of m - 1 steps), so m > 1 is computed only under a budget.
    """

    model: UncertainModel
    horizon: int
    max_facets: int | None
    eps: float
    coupled: bool  # the output depends on w: (x, w) is kept as one set

    def first(self, initial: HPolytope, sample: Sample) -> Outcome:
        return self._measure((initial,), (), sample)

    def next(self, last: Outcome, before: Sample, maps: Maps, sample: Sample) -> Outcome:
        start = last.joint if self.coupled else before.joint(last.joint)
        images = [hull_of_images(start, maps, self.max_facets)]
        if self.max_facets is not None:
            (older,) = last.memory
            for states in older[: self.horizon - 1]:
                further = hull_of_images(before.joint(states), maps, self.max_facets)
                images.append(limited(further, self.max_facets))
        return self._measure((images[0], *map(widened_rows, images[1:])), self._memory(images), sample)

    def _memory(self, images: list[HPolytope]) -> tuple[HPolytope, ...]:
        if self.max_facets is None or self.horizon == 1:
            return ()
        return (limited(images[0], self.max_facets), *images[1:])

    def _measure(self, sets: tuple[HPolytope, ...], memory: tuple[HPolytope, ...], sample: Sample) -> Outcome:
        states = intersection(list(sets))
        both = sample.joint(states)
        rows = output_rows(self.model, sample.stack, both, sample.u, sample.y, sample.noise, self.eps)
        before, known = ((both,), both) if self.coupled else (sets, states)
        if not self.coupled:
            rows = HPolytope(rows.A[:, : self.model.n_states], rows.b)
        data = MeasuredOutput(sample.stack, sample.u, sample.y, sample.noise)
        return _cut(known, before, rows, sample.number, self.max_facets, (memory,), data)


@dataclass(frozen=True)
class PublishedRecursion:
    """Equation (3) of the paper: every vertex stack keeps the sets of all samples and the newest measurement.

    The stacks of m steps are made from those of m - 1, and an empty one is not followed further.
    """

    model: UncertainModel
    horizon: int
    max_facets: int | None
    eps: float

    def first(self, initial: HPolytope, sample: Sample) -> Outcome:
        rows = self._rows(sample, initial)
        outcome = _cut(initial, (initial,), rows, sample.number, self.max_facets, ())
        return outcome._replace(memory=((outcome.joint,),), proofs=((),))

    def next(self, last: Outcome, before: Sample, maps: Maps, sample: Sample) -> Outcome:
        grown = []
        for stacks, proofs in zip(last.memory, last.proofs, strict=True):
            images = [image(before.joint(stack), M, t, self.max_facets) for stack in stacks for M, t in maps]
            rows = [self._rows(sample, P) for P in images]
            grown.append(self._nonempty(images, rows, sample.number, proofs))
        oldest, proofs = grown[0]
        if not oldest:
            return Outcome("falsified", PublishedCertificate(sample.number, proofs), last.joint, (), ())
        hull = oldest[0] if len(oldest) == 1 else self._hull(oldest)
        kept = [(list(oldest), proofs)] if len(grown) < self.horizon else []
        later = [*kept, *grown[1:]]
        tied = [self._nonempty(P, [widened_rows(hull)] * len(P), sample.number, done) for P, done in later]
        tied.append(([hull], ()))
        return Outcome(
            "consistent", None, hull, tuple(tuple(stacks) for stacks, _ in tied), tuple(done for _, done in tied)
        )

    def _hull(self, stacks: list[HPolytope]) -> HPolytope:
        return limited(template(stacks, *hull_normals(stacks, self.max_facets)), self.max_facets)

    def _rows(self, sample: Sample, states: HPolytope) -> HPolytope:
        joint = sample.joint(states)
        rows = output_rows(self.model, sample.stack, joint, sample.u, sample.y, sample.noise, self.eps)
        return HPolytope(rows.A[:, : self.model.n_states], rows.b)

    def _nonempty(
        self, stacks: list[HPolytope], rows: list[HPolytope], number: int, proofs: tuple[PolytopeCertificate, ...]
    ) -> tuple[list[HPolytope], tuple[PolytopeCertificate, ...]]:
        """Stacks cut by their rows; the empty ones leave their proofs."""
        kept = []
        for stack, more in zip(stacks, rows, strict=True):
            outcome = _cut(stack, (stack,), more, number, self.max_facets, ())
            if isinstance(outcome.certificate, PolytopeCertificate):
                proofs = (*proofs, outcome.certificate)
            else:
                kept.append(outcome.joint)
        return kept, proofs


def _cut(
    known: HPolytope,
    before: tuple[HPolytope, ...],
    rows: HPolytope,
    number: int,
    max_facets: int | None,
    memory: tuple[tuple[HPolytope, ...], ...],
    data: MeasuredOutput | None = None,
) -> Outcome:
    """A set cut by more rows. "falsified" only with a proof that has been checked."""
    cut = known.intersection(rows)
    answer = cut.emptiness()
    if answer.certificate is not None:
        certificate = PolytopeCertificate(number, before, rows, answer.certificate, data)
        if certificate.verify():
            return Outcome("falsified", certificate, known, ())
    if answer.status == "nonempty":
        return Outcome("consistent", None, _resolved(cut, known, max_facets), memory)
    return Outcome("undecided", None, limited(known, max_facets), memory)


def _resolved(cut: HPolytope, known: HPolytope, max_facets: int | None) -> HPolytope:
    """The cut set; under a budget the set before the cut, where the cut is too thin for float programs to bound."""
    kept = limited(cut, max_facets)
    if max_facets is not None:
        try:
            reach_of(kept)
        except UndecidedError:
            return limited(known, max_facets)
    return kept
