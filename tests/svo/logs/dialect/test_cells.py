"""Cells become numbers by stated rules, and by nothing else."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from svo.logs.dialect.numbers import numbers_of
from svo.logs.dialect.rules import Channel, Dialect
from svo.logs.dialect.units import conversion


def number(cell: str, dialect: Dialect | None = None, channel: Channel | None = None) -> float:
    return float(numbers_of([cell], lambda i: "line 1", dialect or Dialect(), channel or Channel())[0])


@pytest.mark.parametrize(
    ("cell", "value", "dialect"),
    [
        ("1.5", 1.5, Dialect()),
        ("-.5e-3", -0.0005, Dialect()),
        ("+2.", 2.0, Dialect()),
        ("−3", -3.0, Dialect()),  # U+2212
        ("1,5", 1.5, Dialect(decimal=",")),
        ("1.234,5", 1234.5, Dialect(decimal=",", thousands=".")),
        ("-1,234,567.25", -1234567.25, Dialect(thousands=",")),
        ("12.5", 12.5, Dialect(thousands=",")),
        ("1'234.5", 1234.5, Dialect(thousands="'")),
        ("1\u202f234,5", 1234.5, Dialect(decimal=",", thousands=" ")),
        ("1.5D-2", 0.015, Dialect(exponent="D")),
        ("1.5d+2", 150.0, Dialect(exponent="D")),
    ],
)
def test_a_number_is_read_as_it_is_stated_to_be_written(cell: str, value: float, dialect: Dialect) -> None:
    assert number(cell, dialect) == value


@pytest.mark.parametrize("cell", ["", "nan", "NaN", "NAN", "---", "-99", "-99.0"])
def test_what_is_missing_is_missing(cell: str) -> None:
    assert math.isnan(number(cell, Dialect(missing=("---",), sentinels=(-99.0,))))


@pytest.mark.parametrize(
    ("cell", "dialect", "hint"),
    [
        ("1,5", Dialect(), 'decimal = ","'),
        ("1.5", Dialect(decimal=","), 'decimal = "."'),
        ("1.234,5", Dialect(), 'decimal = "," and thousands = "."'),
        ("1,234.5", Dialect(), 'decimal = "." and thousands = ","'),
        ("1,23,4", Dialect(thousands=","), "missing"),
        ("1.5D-2", Dialect(), 'exponent = "D"'),
        ("0x1F", Dialect(), 'number = "hex16"'),
        ("FF3A", Dialect(), 'number = "hex16"'),
        ("inf", Dialect(), "missing"),
        ("-∞", Dialect(), "missing"),
        ("1e999", Dialect(), "missing"),
        ("1.#QNAN", Dialect(), "missing"),
        ("12.5 mm", Dialect(), "a unit in the cell"),
        ("1_000", Dialect(), "missing"),
        ("Bad Input", Dialect(), "missing"),
        ("1 2", Dialect(), "missing"),
        ("٣", Dialect(), "missing"),  # a digit of another script
    ],
)
def test_any_other_text_is_an_error_that_says_what_to_state(cell: str, dialect: Dialect, hint: str) -> None:
    with pytest.raises(ValueError, match=r"^line 1: .* is no number") as caught:
        number(cell, dialect)
    assert hint in str(caught.value)


@pytest.mark.parametrize(
    ("cell", "kind", "value"),
    [
        ("FFFF", "hex16", -1),
        ("0x7fff", "hex16", 32767),
        ("FFFF", "hex", 65535),
        ("80", "hex8", -128),
        ("0Ah", "hex8", 10),
    ],
)
def test_hexadecimal_has_a_stated_sign(cell: str, kind: str, value: float) -> None:
    assert number(cell, channel=Channel(number=kind)) == value
    with pytest.raises(ValueError, match="no number"):
        number("1FFFF" if kind != "hex" else "xyz", channel=Channel(number=kind))


def test_the_stated_unit_may_stand_in_the_cell() -> None:
    assert number("12.5 mm", channel=Channel(unit="mm")) == 12.5
    with pytest.raises(ValueError, match="no number"):
        number("12.5 cm", channel=Channel(unit="mm"))


@given(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from([".", ","]), st.sampled_from(["", "D"]))
def test_every_float_comes_back_to_the_bit(value: float, decimal: str, exponent: str) -> None:
    text = repr(value).replace(".", decimal).replace("e", exponent or "e")
    assert number(text, Dialect(decimal=decimal, exponent=exponent)) == value


@given(st.integers(-(10**12), 10**12), st.sampled_from([(".", ","), (",", "."), (".", "'"), (",", " ")]))
def test_thousands_are_taken_out_where_they_are_whole(value: int, marks: tuple[str, str]) -> None:
    decimal, thousands = marks
    text = f"{value:,}".replace(",", thousands) + decimal + "25"
    sign = -0.25 if value < 0 else 0.25
    assert number(text, Dialect(decimal=decimal, thousands=thousands)) == value + sign


@pytest.mark.parametrize(
    ("source", "target", "factor", "offset"),
    [
        ("mm", "m", 1e-3, 0.0), ("kN", "N", 1e3, 0.0), ("Newtons", "N", 1.0, 0.0), ("°C", "K", 1.0, 273.15),
        ("rpm", "rad/s", 2 * np.pi / 60, 0.0), ("deg", "rad", np.pi / 180, 0.0), ("m3/h", "m^3/s", 1 / 3600, 0.0),
        ("%", "1", 0.01, 0.0),
    ],
)  # fmt: skip
def test_units_are_converted_to_those_of_the_model(source: str, target: str, factor: float, offset: float) -> None:
    pytest.importorskip("pint")
    np.testing.assert_allclose(conversion(source, target), (factor, offset), rtol=1e-12)


@pytest.mark.parametrize(("source", "target"), [("mm", "N"), ("foo", "m"), ("dBm", "W"), ("mm", "Weg")])
def test_units_that_do_not_fit_are_an_error(source: str, target: str) -> None:
    pytest.importorskip("pint")
    with pytest.raises(ValueError, match=f"'{source}'|'{target}'"):
        conversion(source, target)
