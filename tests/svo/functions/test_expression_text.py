"""Expressions as text: read by a white list, never executed; errors name the symbol and the place."""

from __future__ import annotations

import numpy as np
import pytest

from svo.functions.expression import Recorder, variables
from svo.functions.tape import Tape
from svo.functions.text import parsed


def read(text: str):
    recorder = Recorder()
    h1, Q1 = variables(recorder, 0, 2)
    return recorder, parsed("dynamics of h1", text, recorder, {"h1": h1, "Q1": Q1})


def test_an_expression_is_what_python_would_make_of_it() -> None:
    text = "(Q1 - 0.3*sqrt(2*981*h1))/15.5 + h1**-2 + h1**0.5 - +2**h1 + h1**1.5\n + max(h1, Q1)*pi - min(abs(-h1), 3)"
    recorder, row = read(text)
    h1, Q1 = 4.2, 2.5
    expected = (Q1 - 0.3 * (2 * 981 * h1) ** 0.5) / 15.5 + h1**-2 + h1**0.5 - 2**h1 + h1**1.5 + h1 * np.pi - 3
    assert Tape.of(recorder, [row], 2).values(np.array([h1, Q1])) == pytest.approx([expected], rel=1e-14)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("__import__('os').system('x')", "unknown function .__import__"),
        ("h1.__class__", "not allowed"),
        ("h1[0]", "not allowed"),
        ("[h1 for h1 in Q1]", "not allowed"),
        ("lambda: h1", "not allowed"),
        ("h1 if Q1 else 2", "not allowed"),
        ("h1 < 2", "not allowed"),
        ("(h1 := 3)", "not allowed"),
        ("f'{h1}'", "not allowed"),
        ("'a'", "no number"),
        ("True", "no number"),
        ("1j", "no number"),
        ("h1 + h11", "unknown symbol 'h11'; did you mean 'h1'.*column 6"),
        ("h1 + leak", "unknown symbol 'leak'; expected one of h1, Q1, pi.*column 6"),
        ("h1 + sine(Q1)", "unknown function 'sine'; expected one of abs, .*column 6"),
        ("sin(h1, Q1)", "takes 1 argument"),
        ("atan2(h1)", "takes 2 arguments"),
        ("sin(x=h1)", "takes 1 argument"),
        ("1 +", "invalid syntax"),
        ("", "invalid syntax"),
        ("h1; Q1", "invalid syntax"),
        ("h1 / (2 - 2)", "column 1"),
        ("h1 + sqrt(1 - 3)", "its argument may be negative.*column 6"),
        ("10**400 * h1", "column 1"),
        ("1" + "0" * 400, "too large"),
        ("9**9**9**9**9", "column"),
        ("-" * 5000 + "h1", "nested too deeply"),
        ("(" * 150 + "h1" + ")" * 150 + "+ )", "unmatched"),
        ("h1 +" * 20_000 + "h1", "characters"),
        ("h1\x00", "null"),
    ],
)
def test_what_is_not_allowed_is_named_with_its_place(text: str, why: str) -> None:
    with pytest.raises(ValueError, match=f"(?s)dynamics of h1.*{why}"):
        read(text)


def test_what_is_no_text_is_a_type_error() -> None:
    with pytest.raises(TypeError, match="dynamics of h1 is a float; expected an expression as text"):
        parsed("dynamics of h1", 2.0, Recorder(), {})  # type: ignore[arg-type]
