"""How the certificate of each kind of observer is stored, what it proves, and how its data compare with a log.

A further observer joins by an `AlarmKind` in `KINDS`; `svo.isolation.alarms` knows nothing of any of them. Floats are
written in hexadecimal, so that a stored proof is about exactly the numbers that the observer saw.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from polytopes import Certificate
from svo.checks import Array
from svo.logs.log import Log
from svo.models.digest import ModelSample
from svo.models.normal_form import Exponents
from svo.observers.polytope.step import MeasuredOutput, PolytopeCertificate
from svo.observers.window.evidence import ArrivalSet, WindowCertificate, WindowSample
from svo.observers.window.sign_split import SplitCertificate
from svo.observers.zonotope.certificate import ZonotopeCertificate
from svo.observers.zonotope.zonotope import ConstrainedZonotope
from svo.store.values import (
    check_keys,
    decode_array,
    decode_arrays,
    decode_integer,
    decode_integers,
    decode_set,
    encode_value,
)


@dataclass(frozen=True)
class AlarmKind:
    """One kind of certificate on disk.

    Attributes
    ----------
    name : str
        As stored in the record.
    certificate : type
    encode : callable
        Certificate to what JSON can hold.
    decode : callable
        The other way; any ArithmeticError, AttributeError, LookupError, TypeError or ValueError says that the record
        is none of this kind.
    model_data : callable
        Certificate to what it holds of its model, a `ModelSample` for each sample up to that of the falsification.
    proves : callable
        (certificate, sample of the alarm) to the words for what a proof that holds rests on.
    difference : callable
        (certificate, sample, log) to the first way in which the data are not those of the log, or None.
    """

    name: str
    certificate: type
    encode: Callable[[Any], Any]
    decode: Callable[[Any], Any]
    model_data: Callable[[Any], tuple[ModelSample, ...]]
    proves: Callable[[Any, int], str]
    difference: Callable[[Any, int, Log], str | None]


def kind_of(certificate: Any) -> AlarmKind:
    """The kind of a certificate.

    Raises
    ------
    TypeError
        If certificates of this type cannot be stored.
    """
    for kind in KINDS:
        if type(certificate) is kind.certificate:
            return kind
    known = ", ".join(kind.certificate.__name__ for kind in KINDS)
    raise TypeError(f"certificate is {type(certificate).__name__}, which no alarm can store; expected one of {known}")


def model_data(certificate: Any) -> tuple[ModelSample, ...]:
    """What a certificate holds of its model, sample by sample up to that of the falsification."""
    return kind_of(certificate).model_data(certificate)


# -- comparisons with a log ---------------------------------------------------------------------------------------


def output_difference(k: int, y: Array, u: Array, driven: bool, log: Log) -> str | None:
    """How y and u of a sample differ from those of the log.

    A measurement (NaN) that the observer did not use takes nothing from a proof; u counts where ``driven``.
    """
    used = ~np.isnan(y)
    if used.shape != log.y[k].shape or not np.array_equal(y[used], log.y[k][used]):
        return f"y of sample {k} differs from the log"
    if driven and not np.array_equal(u, log.u[k]):
        return f"u of sample {k} differs from the log"
    return None


# -- what every kind may hold -------------------------------------------------------------------------------------

_LARGEST_AT, _UNITS = "largest_at", "units"


def _names(kind: type) -> set[str]:
    return {field.name for field in fields(kind)}


def _entries(kind: type, record: Any) -> set[str]:
    """Entries of a record of this kind.

    That of the largest set is there only where it is a premise; that of units since observers have a normal form.
    """
    absent = {_LARGEST_AT, _UNITS} - record.keys() if isinstance(record, Mapping) else set()
    return _names(kind) - absent


def _largest_at(record: Mapping[str, Any]) -> int | None:
    return decode_integer(record[_LARGEST_AT]) if _LARGEST_AT in record else None


def _started_again(largest_at: int | None, last: int, sample: int) -> str:
    """The premise of a set that started again; the observer's sample ``last`` is the log's ``sample``."""
    if largest_at is None:
        return ""
    return f", and the largest set at sample {sample - last + largest_at}, where the set started again"


# -- window observers --------------------------------------------------------------------------------------------


_NO_ARRAYS = {"first", "last", "n", "late", "owner", "arrival", "samples", _LARGEST_AT, _UNITS}


def _decode_window(record: Any) -> WindowCertificate:
    check_keys(record, _entries(WindowCertificate, record))
    if type(record["late"]) is not bool:
        raise TypeError("late is not true or false")
    if not isinstance(record["samples"], list):
        raise TypeError("samples is no list")
    arrays: dict[str, Any] = {name: decode_array(record[name]) for name in record.keys() - _NO_ARRAYS}
    return WindowCertificate(
        first=decode_integer(record["first"]),
        last=decode_integer(record["last"]),
        n=decode_integer(record["n"]),
        late=record["late"],
        owner=decode_integers(record["owner"]),
        arrival=ArrivalSet(**decode_arrays(record["arrival"], _names(ArrivalSet))),
        samples=tuple(WindowSample(**decode_arrays(sample, _names(WindowSample))) for sample in record["samples"]),
        largest_at=_largest_at(record),
        units=_decode_units(record[_UNITS]) if _UNITS in record else None,
        **arrays,
    )


def _window_proves(c: WindowCertificate, sample: int) -> str:
    known = "the readings of its window alone" if c.arrival.is_unknown else "the arrival set"
    return known + _started_again(c.largest_at, c.last, sample)


def _decode_units(record: Any) -> Exponents:
    check_keys(record, _names(Exponents))
    return Exponents(**{name: decode_integers(value) for name, value in record.items()})


def _window_difference(c: WindowCertificate, last: int, log: Log) -> str | None:
    # an observer that was started again counts its own samples
    samples = range(last - (c.last - c.first), last + 1)
    if samples[0] < 0:
        return f"samples {samples[0]} to {last} do not belong to a log of {len(log)} samples"
    for k, sample in zip(samples, c.samples, strict=True):
        driven = k < last or _takes_part(sample, c.n)
        difference = output_difference(k, sample.y, sample.u, driven, log)
        if difference is not None:
            return difference
    return None


def _takes_part(newest: WindowSample, n: int) -> bool:
    """Whether the newest input does: it enters the output, or an uncertainty that it drives does."""
    on_u, on_y = newest.stack[:, :, n : n + newest.u.size], newest.stack[1:, n:]
    shared = on_u[1:].any(axis=(1, 2)) & on_y.any(axis=(1, 2))
    return bool(on_u[:, n:].any() or shared.any())


def _window_model(c: WindowCertificate) -> tuple[ModelSample, ...]:
    """w of the last sample is no part of a window unless it enters the output there."""
    return tuple(
        ModelSample(s.stack, s.noise, (s.w_lower, s.w_upper) if c.late or k < c.last else None)
        for k, s in enumerate(c.samples, start=c.first)
    )


WINDOW = AlarmKind(
    "window",
    WindowCertificate,
    encode_value,
    _decode_window,
    _window_model,
    _window_proves,
    _window_difference,
)


def _decode_split(record: Any) -> SplitCertificate:
    check_keys(record, _names(SplitCertificate))
    cells = tuple(_decode_window(cell) for cell in record["cells"])
    return SplitCertificate(cells, decode_array(record["s_lower"]), decode_array(record["s_upper"]))


def _split_difference(c: SplitCertificate, last: int, log: Log) -> str | None:
    return _window_difference(c.cells[0], last, log)  # `verify` holds the cells against each other


SPLIT = AlarmKind(
    "window split by signs",
    SplitCertificate,
    encode_value,
    _decode_split,
    lambda c: _window_model(c.cells[0]),
    lambda c, sample: _window_proves(c.cells[0], sample),
    _split_difference,
)


# -- constrained-zonotope observers ------------------------------------------------------------------------------


def _decode_zonotope(record: Any) -> ZonotopeCertificate:
    check_keys(record, _names(ZonotopeCertificate))
    return ZonotopeCertificate(
        arrival=ConstrainedZonotope(**decode_arrays(record["arrival"], _names(ConstrainedZonotope))),
        multipliers=decode_array(record["multipliers"]),
        window=_decode_window(record["window"]),
    )


def _zonotope_difference(c: ZonotopeCertificate, last: int, log: Log) -> str | None:
    return _window_difference(c.window, last, log)


ZONOTOPE = AlarmKind(
    "constrained zonotope",
    ZonotopeCertificate,
    encode_value,
    _decode_zonotope,
    lambda c: _window_model(c.window),
    lambda c, sample: _window_proves(c.window, sample),
    _zonotope_difference,
)


# -- polytope observers ------------------------------------------------------------------------------------------


def _encode_polytope(c: PolytopeCertificate) -> Any:
    if c.data is None:
        raise TypeError("certificate is that of a vertex stack of equation (3), which proves nothing of the model")
    return encode_value(c)


def _decode_polytope(record: Any) -> PolytopeCertificate:
    check_keys(record, _entries(PolytopeCertificate, record))
    return PolytopeCertificate(
        sample=decode_integer(record["sample"]),
        before=tuple(decode_set(item) for item in record["before"]),
        measurement=decode_set(record["measurement"]),
        multipliers=Certificate.from_dict(record["multipliers"]),
        data=MeasuredOutput(**decode_arrays(record["data"], _names(MeasuredOutput))),
        largest_at=_largest_at(record),
    )


def _polytope_proves(c: PolytopeCertificate, sample: int) -> str:
    assert c.data is not None
    rows = "" if c.data.explains(c.measurement) else ", and the bounds of the uncertain output"
    return f"the set before the measurement{rows}" + _started_again(c.largest_at, c.sample, sample)


def _polytope_difference(c: PolytopeCertificate, last: int, log: Log) -> str | None:
    assert c.data is not None
    n = c.data.stack.shape[1] - c.data.y.size
    driven = bool(np.any(c.data.stack[:, n:, n : n + c.data.u.size]))
    return output_difference(last, c.data.y, c.data.u, driven, log)


def _polytope_model(c: PolytopeCertificate) -> tuple[ModelSample, ...]:
    assert c.data is not None
    return (ModelSample(c.data.stack, c.data.noise, None),)


POLYTOPE = AlarmKind(
    "polytope",
    PolytopeCertificate,
    _encode_polytope,
    _decode_polytope,
    _polytope_model,
    _polytope_proves,
    _polytope_difference,
)

KINDS = (WINDOW, SPLIT, ZONOTOPE, POLYTOPE)
