"""From the normal form, which observers compute in, back to the units of the user; powers of two round nothing.

The multiplied rows of a proof are scalars, which no units touch: s, p, Delta, the lines and the multipliers of rows of
states and disturbances are the same numbers in both. A multiplier of an output is divided by the output's unit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from polytopes import Certificate, HPolytope
from polytopes.exact import rational
from svo.checks import Array
from svo.models import NormalForm
from svo.models.normal_form import lengthened
from svo.observers.polytope.certificate import (
    AnyCertificate,
    MeasuredOutput,
    PolytopeCertificate,
    PublishedCertificate,
)
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.evidence import ArrivalSet, WindowSample
from svo.observers.window.left_out import with_channels
from svo.observers.zonotope.certificate import ZonotopeCertificate
from svo.observers.zonotope.zonotope import ConstrainedZonotope


def arrival_in(arrival: ArrivalSet, form: NormalForm) -> ArrivalSet:
    """A set of first states in normal form."""
    return replace(
        arrival,
        box_lower=arrival.box_lower / form.x,
        box_upper=arrival.box_upper / form.x,
        rows=arrival.rows * form.x,
    )


def arrival_out(arrival: ArrivalSet, form: NormalForm) -> ArrivalSet:
    """A set of first states in normal form, in the user's units."""
    return replace(
        arrival,
        box_lower=arrival.box_lower * form.x,
        box_upper=arrival.box_upper * form.x,
        rows=arrival.rows / form.x,
    )


def window_out(c: WindowCertificate, form: NormalForm) -> WindowCertificate:
    """A proof about the model and the data as they were given."""
    arrival = arrival_out(c.arrival, form)
    samples = tuple(_sample_out(s, form) for s in c.samples)
    out = replace(c, arrival=arrival, samples=samples, w_rows=c.w_rows / form.w, units=form.exponents)
    return with_channels(out)


def _sample_out(s: WindowSample, form: NormalForm) -> WindowSample:
    return replace(
        s,
        stack=s.stack / form.exponents.factor,
        u=s.u * form.u,
        y=s.y * form.y,
        noise=s.noise * form.y,
        slack=s.slack * form.y,
        w_lower=s.w_lower * form.w,
        w_upper=s.w_upper * form.w,
        on_output=s.on_output / form.y,
    )


def zonotope_out(Z: ConstrainedZonotope, unit: Array) -> ConstrainedZonotope:
    """{unit x : x in Z}."""
    return replace(Z, center=Z.center * unit, generators=Z.generators * unit[:, None], room=Z.room * unit)


def zonotope_proof_out(c: ZonotopeCertificate, form: NormalForm) -> ZonotopeCertificate:
    """As `window_out`."""
    return replace(c, arrival=zonotope_out(c.arrival, form.x), window=window_out(c.window, form))


def measurement_out(data: MeasuredOutput, form: NormalForm) -> MeasuredOutput:
    """Model and data of a sample."""
    return MeasuredOutput(data.stack / form.exponents.factor, data.u * form.u, data.y * form.y, data.noise * form.y)


def polytope_proof_out(c: AnyCertificate, form: NormalForm) -> AnyCertificate:
    """As `window_out`, for the proof of a polytope observer; its measurement rows become those of the outputs."""
    if isinstance(c, PublishedCertificate):
        return replace(c, stacks=tuple(_polytope_out(stack, form) for stack in c.stacks))
    return _polytope_out(c, form)


def _polytope_out(c: PolytopeCertificate, form: NormalForm) -> PolytopeCertificate:
    sets = [*c.before, c.measurement]
    unit = np.concatenate([form.x, form.w])[: sets[0].dim]
    factors = [(lengthened(P.A, 1.0 / unit), lengthened(P.C, 1.0 / unit)) for P in sets]
    if c.data is not None:  # two rows a sensor that was read
        factors[-1] = np.repeat(form.y[~np.isnan(c.data.y)], 2), factors[-1][1]
    given = [
        HPolytope(P.A / unit * f[:, None], P.b * f, P.C / unit * g[:, None], P.d * g)
        for P, (f, g) in zip(sets, factors, strict=True)
    ]
    on_rows, on_equalities = (np.concatenate(parts) for parts in zip(*factors, strict=True))
    return replace(
        c,
        before=tuple(given[:-1]),
        measurement=given[-1],
        multipliers=Certificate(
            {i: m / rational(on_rows[i]) for i, m in c.multipliers.inequality.items()},
            {i: m / rational(on_equalities[i]) for i, m in c.multipliers.equality.items()},
        ),
        data=None if c.data is None else measurement_out(c.data, form),
    )
