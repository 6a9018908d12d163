"""Arrays as text in JSON: what is written comes back bit for bit, and nothing else is read."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from svo.store.values import decode_array, decode_float, encode_value

WORDS = ("0", "nan", "inf", "-inf", "-0x0.0p+0", "0x1.8000000000000p+0", "0x0.0000000000001p-1022")
WRONG = (
    "",
    "50",
    "0x50",
    "1.0",
    "0x2.0p+0",
    "0X1.0p+0",
    "0x1.0p0",
    "+inf",
    "-nan",
    "-0",
    "infinity",
    "0x1.0p+0\n",
    "٠",
)


@given(st.lists(st.floats(width=64), max_size=20))
def test_floats_come_back_bit_for_bit(values: list[float]) -> None:
    array = np.array(values, dtype=np.float64)
    back = decode_array(encode_value(array))
    np.testing.assert_array_equal(back, array)
    np.testing.assert_array_equal(np.signbit(back)[~np.isnan(array)], np.signbit(array)[~np.isnan(array)])


@given(st.lists(st.sampled_from(WORDS + WRONG + ("0 0", " ")), min_size=1, max_size=6))
def test_many_words_are_read_exactly_where_each_of_them_is(words: list[str]) -> None:
    record: dict[str, Any] = {"shape": [-1], "hex": " ".join(words)}
    parts = record["hex"].split(" ") if record["hex"] else []
    wrong = [word for word in parts if word not in WORDS]
    if wrong:
        with pytest.raises(ValueError, match=r"expected a float as float\.hex writes it, found") as error:
            decode_array(record)
        assert str(error.value).endswith(repr(wrong[0]))
    else:
        np.testing.assert_array_equal(decode_array(record), [decode_float(word) for word in parts])
