"""The door to the compiled core: which arrays it takes, and the room that it is given."""

import ctypes

import numpy as np
import pytest

from polytopes import HPolytope, kernel
from polytopes.native import Entries, Given, Integer, floats, function


@pytest.mark.parametrize("columns", [2, 1000])
@pytest.mark.parametrize("form", ["as it is", "read-only", "strided", "F"])
def test_arrays_are_read_in_any_layout(columns: int, form: str) -> None:
    scaled = function("fdi_exponents", *[Integer] * 2, *[Given] * 2, *[Entries] * 3)
    rows = np.ones((2, columns))
    rows[0], rows[:, 0] = 8.0, 4.0
    given = {"strided": np.repeat(rows, 2, axis=1)[:, ::2], "F": np.asfortranarray(rows)}.get(form, rows)
    given.flags.writeable = form != "read-only"
    r, s, block = np.empty(2, np.int64), np.empty(columns, np.int64), np.empty(20 * columns + 100)
    scaled(2, columns, given, np.ones(2), r, s, block)
    expected = kernel.exponents(rows, np.ones(2))
    np.testing.assert_array_equal(np.concatenate([r, s]), np.concatenate(expected))


@pytest.mark.parametrize("form", ["read-only", "strided"])
def test_what_is_written_must_be_writeable_and_contiguous(form: str) -> None:
    exponents = function("fdi_exponents", *[Integer] * 2, *[Given] * 2, *[Entries] * 3)
    s = np.empty(4, np.int64)[::2] if form == "strided" else np.empty(2, np.int64)
    s.flags.writeable = form != "read-only"
    with pytest.raises(ctypes.ArgumentError):
        exponents(1, 2, np.ones((1, 2)), np.ones(1), np.empty(1, np.int64), s, np.empty(100))


@pytest.mark.parametrize("form", ["F", "strided", "byte order", "integer", "misaligned"])
def test_floats_are_one_layout_whatever_came(form: str) -> None:
    values = np.arange(12.0).reshape(3, 4)
    moved = np.zeros(8 * 12 + 1, np.uint8)[1:].view(np.float64).reshape(3, 4)
    moved[:] = values
    given = {
        "F": np.asfortranarray(values), "strided": np.repeat(values, 2, axis=1)[:, ::2],
        "byte order": values.astype(">f8"), "integer": values.astype(int), "misaligned": moved,
    }[form]  # fmt: skip
    found = floats(given)
    np.testing.assert_array_equal(found, values)
    assert found.flags.c_contiguous
    assert found.flags.aligned
    assert found.dtype == np.float64
    assert found.dtype.isnative


def test_an_elimination_goes_on_where_its_room_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    A = rng.standard_normal((30, 5))
    arguments = (np.zeros(30, np.int64), np.arange(5), np.arange(2), np.zeros(5), 10_000, False)
    table = np.hstack([A / np.linalg.norm(A, axis=1)[:, None], rng.uniform(0.5, 1.5, (30, 1))])
    expected = kernel.eliminate(table, *arguments)
    monkeypatch.setattr(kernel, "_ROOM", 1)
    for found, right in zip(kernel.eliminate(table, *arguments), expected, strict=True):
        np.testing.assert_array_equal(found, right)


def test_directions_of_any_layout_have_the_same_supports() -> None:
    P = HPolytope.box([-1.0, 0.0, 2.0], [1.0, 0.5, 3.0])
    C = np.random.default_rng(0).standard_normal((5, 3))
    np.testing.assert_array_equal(P.support_points(np.asfortranarray(C)).values, P.support_points(C).values)
