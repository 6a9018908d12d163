"""How the certificate of each kind of observer is stored, what it proves, and how its data compare with a log.

A further observer joins by an `AlarmKind` in `KINDS`; `svo.alarms` knows nothing of any of them. Floats are written
in hexadecimal, so that a stored proof is about exactly the numbers that the observer saw.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes import Certificate, HPolytope
from svo.log import Log
from svo.observers.constrained_zonotope import ConstrainedZonotope
from svo.observers.polytope_step import MeasuredOutput, PolytopeCertificate
from svo.observers.proof import ArrivalSet, WindowCertificate, WindowSample
from svo.observers.sign_split import SplitCertificate
from svo.observers.zonotope_proof import ZonotopeCertificate

Array = NDArray[np.float64]


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
    proves : callable
        Certificate to the words for what a proof that holds has shown.
    difference : callable
        (certificate, sample, log) to the first way in which the data are not those of the log, or None.
    """

    name: str
    certificate: type
    encode: Callable[[Any], Any]
    decode: Callable[[Mapping[str, Any]], Any]
    proves: Callable[[Any], str]
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


# -- values ------------------------------------------------------------------------------------------------------


def encode_value(value: Any) -> Any:
    """Arrays, tuples and dataclasses of them as lists, dicts and text."""
    if isinstance(value, np.ndarray):
        if np.issubdtype(value.dtype, np.integer):
            return value.tolist()
        return {"shape": list(value.shape), "hex": " ".join(_hex(v) for v in value.ravel())}
    if isinstance(value, tuple):
        return [encode_value(item) for item in value]
    if isinstance(value, HPolytope):
        return {part: encode_value(getattr(value, part)) for part in "AbCd"}
    if isinstance(value, Certificate):
        return value.to_dict()
    if hasattr(type(value), "__dataclass_fields__"):
        return {f.name: encode_value(getattr(value, f.name)) for f in fields(value)}
    return value


def decode_array(value: Any) -> Array:
    """A float array that `encode_value` wrote."""
    numbers = np.array([float.fromhex(v) for v in value["hex"].split()])
    return numbers.reshape(value["shape"])


def decode_arrays(record: Mapping[str, Any]) -> dict[str, Array]:
    """Every entry of a record as a float array."""
    return {key: decode_array(value) for key, value in record.items()}


def decode_set(record: Mapping[str, Any]) -> HPolytope:
    """A polytope that `encode_value` wrote."""
    return HPolytope(*(decode_array(record[part]) for part in "AbCd"))


def _hex(value: float) -> str:
    text = float(value).hex()
    return "0" if text == "0x0.0p+0" else text


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


# -- window observers --------------------------------------------------------------------------------------------


def _decode_window(record: Mapping[str, Any]) -> WindowCertificate:
    arrays = {key: decode_array(value) for key, value in record.items() if isinstance(value, dict) and "hex" in value}
    return WindowCertificate(
        first=int(record["first"]),
        last=int(record["last"]),
        n=int(record["n"]),
        late=bool(record["late"]),
        owner=np.array(record["owner"], dtype=np.int64),
        arrival=ArrivalSet(**decode_arrays(record["arrival"])),
        samples=tuple(WindowSample(**decode_arrays(sample)) for sample in record["samples"]),
        **arrays,
    )


def _window_difference(c: WindowCertificate, last: int, log: Log) -> str | None:
    # an observer that was started again counts its own samples
    samples = range(last - (c.last - c.first), last + 1)
    if samples[0] < 0:
        return f"samples {samples[0]} to {last} do not belong to a log of {len(log)} samples"
    for k, sample in zip(samples, c.samples, strict=True):
        driven = k < last or bool(np.any(sample.stack[:, c.n :, c.n : c.n + sample.u.size]))
        difference = output_difference(k, sample.y, sample.u, driven, log)
        if difference is not None:
            return difference
    return None


WINDOW = AlarmKind(
    "window", WindowCertificate, encode_value, _decode_window, lambda _: "the arrival set", _window_difference
)


def _decode_split(record: Mapping[str, Any]) -> SplitCertificate:
    cells = tuple(_decode_window(cell) for cell in record["cells"])
    return SplitCertificate(cells, decode_array(record["s_lower"]), decode_array(record["s_upper"]))


def _split_difference(c: SplitCertificate, last: int, log: Log) -> str | None:
    return _window_difference(c.cells[0], last, log)  # `verify` holds the cells against each other


SPLIT = AlarmKind(
    "window split by signs",
    SplitCertificate,
    encode_value,
    _decode_split,
    lambda _: "the arrival set",
    _split_difference,
)


# -- constrained-zonotope observers ------------------------------------------------------------------------------


def _decode_zonotope(record: Mapping[str, Any]) -> ZonotopeCertificate:
    return ZonotopeCertificate(
        arrival=ConstrainedZonotope(**decode_arrays(record["arrival"])),
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
    lambda _: "the arrival set",
    _zonotope_difference,
)


# -- polytope observers ------------------------------------------------------------------------------------------


def _encode_polytope(c: PolytopeCertificate) -> Any:
    if c.data is None:
        raise TypeError("certificate is that of a vertex stack of equation (3), which proves nothing of the model")
    return encode_value(c)


def _decode_polytope(record: Mapping[str, Any]) -> PolytopeCertificate:
    return PolytopeCertificate(
        sample=int(record["sample"]),
        before=tuple(decode_set(item) for item in record["before"]),
        measurement=decode_set(record["measurement"]),
        multipliers=Certificate.from_dict(record["multipliers"]),
        data=MeasuredOutput(**decode_arrays(record["data"])),
    )


def _polytope_proves(c: PolytopeCertificate) -> str:
    assert c.data is not None
    rows = "" if c.data.explains(c.measurement) else ", and the bounds of the uncertain output"
    return f"the set before the measurement{rows}"


def _polytope_difference(c: PolytopeCertificate, last: int, log: Log) -> str | None:
    assert c.data is not None
    n = c.data.stack.shape[1] - c.data.y.size
    driven = bool(np.any(c.data.stack[:, n:, n : n + c.data.u.size]))
    return output_difference(last, c.data.y, c.data.u, driven, log)


POLYTOPE = AlarmKind(
    "polytope", PolytopeCertificate, _encode_polytope, _decode_polytope, _polytope_proves, _polytope_difference
)

KINDS = (WINDOW, SPLIT, ZONOTOPE, POLYTOPE)
