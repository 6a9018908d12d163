"""Mistakes in a nonlinear model: one error each, with its place, before any run; text is never executed."""

from __future__ import annotations

import math
import re
from time import process_time

import numpy as np
import pytest

from polytopes import HPolytope
from svo import ArchitectureII, Log, WindowObserver
from svo.functions import sqrt
from svo.models.nonlinear import NonlinearModel

GIVEN = {
    "f": lambda x, u, w: [u[0] - sqrt(x[0]) + w[0], sqrt(x[0]) - sqrt(x[1])], "h": lambda x: [x[1]],
    "states": ["h1", "h2"], "inputs": ["Q"], "disturbances": ["leak"], "w": [0.1], "n": 0.1,
    "largest": ([0, 0], [9, 9]),
}  # fmt: skip


def scalar(f, h="x", **changes) -> NonlinearModel:
    return NonlinearModel(
        {"x": f} if isinstance(f, str) else f, {"y": h} if isinstance(h, str) else h, states=["x"], inputs=["u"],
        n=0.1, largest=([0], [5]), Ts=0.1, **changes,
    )  # fmt: skip


# -- text ----------------------------------------------------------------------------------------------------

NOT_ALLOWED = [
    "x.real", "x.__class__", "().__class__.__bases__", "[v for v in (1,)]", "{x: 1}", "{x}", "lambda: x", "x ^ 2",
    "x if u else 1", "x > 1", "1 < x < 2", "x and u", "not x", "x[0]", "(y := x)", "f'{x}'", "x % 2", "x // 2", "x @ u",
    "~x", "x << 1", "x | u", "await x", "math.pi", "*x", "(x, u)",
]  # fmt: skip
OTHERS = {
    "": "f, row x: invalid syntax, it is empty",
    "  \n ": "f, row x: invalid syntax, it is empty",
    "x +": "invalid syntax",
    "x y": "invalid syntax at column",
    "x; u": "invalid syntax",
    "x = 1": "invalid syntax",
    "(x": r"'\(' was never closed",
    "x\x00": "null bytes",
    "x\u200b": "non-printable character",
    "'a' * 3": "'a' is no number",
    "b'a'": "is no number",
    "1j * x": "1j is no number",
    "True": "True is no number",
    "None": "None is no number",
    "...": "Ellipsis is no number",
    "v + u": "unknown symbol 'v'; expected one of x, u, pi .column 1",
    "pii": "did you mean 'pi'",
    "sin": r"unknown symbol 'sin'; it is a function: expected sin\(...\)",
    "sine(x)": "unknown function 'sine'; expected one of .*, such as sin",
    "x(u)": "unknown function 'x'",
    "np.sin(x)": "unknown function 'np.sin'",
    "__import__('os').system('touch /tmp/x')": "unknown function .*__import__",
    "eval('x')": "unknown function 'eval'",
    "open('f')": "unknown function 'open'",
    "sin()": "sin takes 1 argument",
    "sin(x, u)": "sin takes 1 argument",
    "sin(x=1)": "sin takes 1 argument",
    "max(x)": "max takes 2 arguments",
    "1 / 0": "1 / .* of a constant has no value: it divides by a range that contains zero",
    "sqrt(-1)": "its argument may be negative",
    "log(0)": "its argument may be zero or negative",
    "1e400 * x": "a number is too large",
    "9**9**9**9": "beyond all floats",
    "2**100000": "beyond all floats",
    "x" * 30_000: "has 30000 characters; expected at most 20000",
    "(" * 500 + "x" + ")" * 500: "too many nested parentheses",
    "-" * 6000 + "x": "nested too deeply",
    "x" + "+x" * 9000: "nested too deeply",
    "sin(" * 90 + "x" + ")" * 89: "never closed",
    "9" * 10_000: "f, row x: a number has too many digits",
}


@pytest.mark.parametrize("text", NOT_ALLOWED)
def test_a_node_that_is_not_on_the_white_list_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"is not allowed; expected|invalid syntax") as caught:
        scalar(text)
    assert "f, row x" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", OTHERS, ids=range(len(OTHERS)))
def test_text_that_is_no_expression_is_one_error_within_a_second(text: str) -> None:
    begun = process_time()
    with pytest.raises(ValueError, match=OTHERS[text]) as caught:
        scalar(text)
    assert process_time() - begun < 1.0
    assert "f, row x" in str(caught.value)
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("if", "-if * x", "invalid syntax.*; no expression can have the name 'if': expected letters, digits and _"),
        ("a b", "-a * x", "unknown symbol 'a'; expected one of x, u, pi; no expression can have the name 'a b'"),
        ("2a", "-2a * x", "invalid .*; no expression can have the name '2a'"),
        ("", "-a * x", "no expression can have the name ''"),
        ("a[0]", "-a[0] * x", "is not allowed"),
        ("\u00b5", "-\u00b5 * x", None),  # a micro sign, which Python's grammar reads as a mu
        ("k\u00f6", "-ko\u0308 * x", None),
    ],
)
def test_names_that_an_expression_can_have(name: str, text: str, why: str | None) -> None:
    given = {"parameters": {name: 2.0}}
    if why is None:
        assert scalar(text, **given).flow.tape.values(np.array([3.0, 2.0, 0.0])).tolist() == [-6.0]
        return
    with pytest.raises(ValueError, match=why):
        scalar(text, **given)


@pytest.mark.parametrize("text", ["((x**64)**64)**64", "x**x**x", "x**1e9", "exp(exp(exp(exp(x))))", "x*x" * 1])
def test_a_bomb_of_powers_is_a_few_operations(text: str) -> None:
    begun = process_time()
    model = scalar(text)
    assert process_time() - begun < 1.0
    assert len(model.flow.tape.op) < 60


# -- functions -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("f", "error", "why"),
    [
        (lambda x: [x[0] if x[0] == 1.0 else 0.0], TypeError, "no truth value while a function is traced"),
        (lambda x: [x[0] if x[0] != 1.0 else 0.0], TypeError, "no truth value"),
        (lambda x: [1.0 if x[0] in (1.0, 2.0) else 0.0], TypeError, "no truth value"),
        (lambda x: [np.maximum(x[0], 0.0)], TypeError, "no truth value"),
        (lambda x: [np.sin(x[0])], TypeError, "expected the functions of svo.functions, not numpy's"),
        (lambda x: np.sqrt(x), TypeError, "expected the functions of svo.functions, not numpy's"),
        (lambda x: [math.sin(x[0])], TypeError, "expected the functions of svo.functions"),
        (lambda x: [x[0] % 2], TypeError, "f: unsupported operand"),
        (lambda x: [int(x[0])], TypeError, "f: int"),
        (lambda x: [x.level], ValueError, "f cannot be traced, AttributeError: .*'level'"),
        (lambda x: [x["x"]], ValueError, "f reads an entry that is not there"),
        (lambda x: [{}["k"]], ValueError, "f cannot be traced, KeyError: 'k'"),
        (lambda x: [nothing * x[0]], ValueError, "f cannot be traced, NameError"),  # noqa: F821
        (lambda x: [x[0] / 0.0], ValueError, "f: 1 / .* has no value"),
        (lambda x: [[x[0]]], TypeError, r"f, row x: \[<expression>\] is used in an expression"),
        (lambda x: None, TypeError, "f returned a NoneType; expected 1 rows: x"),
        (lambda x: {"x": x[0]}, TypeError, "f returned a dict"),
        (lambda x: "x", TypeError, "f returned a str"),
        (lambda x: [float("nan") * x[0]], TypeError, "f: nan is used"),
    ],
)
def test_a_function_that_cannot_be_traced_is_one_error(f, error, why) -> None:
    with pytest.raises(error, match=why):
        scalar(f, lambda x: x)


@pytest.mark.parametrize(
    ("changes", "error", "why"),
    [
        ({"states": 3}, TypeError, "states is 3; expected a list of names"),
        ({"states": None}, TypeError, "states is None"),
        ({"states": {"h1": 0, "h2": 1}}, TypeError, "states is {'h1'"),
        ({"states": []}, ValueError, "states is empty"),
        ({"inputs": None}, TypeError, "inputs is None"),
        ({"outputs": 3}, TypeError, "outputs is 3"),
        ({"outputs": ["a", "b"]}, ValueError, "h returned 1 rows; expected 2"),
        ({"parameters": [("a", 1)]}, TypeError, "parameters is a list; expected a mapping"),
        ({"parameters": {1: (1, 2)}}, TypeError, r"parameters is \[1\]; expected a list of names"),
        ({"parameters": {"a": "b"}}, TypeError, r"parameters\['a'\]"),
        ({"parameters": {"a": (1, 2, 3)}}, ValueError, r"parameters\['a'\] has shape \(3,\)"),
        ({"Ts": "a"}, ValueError, "Ts is 'a'; expected a positive sampling time"),
        ({"n": "a"}, TypeError, "n has dtype"),
        ({"n": -1.0}, ValueError, "n is .*>= 0"),
        ({"w": 3}, ValueError, "w has shape"),
        ({"physical": 3}, ValueError, "physical is 3; expected"),
        ({"valid": ([9, 9], [0, 0])}, ValueError, "valid is between"),
        ({"valid": ([0, 10], [20, 20])}, ValueError, "largest and valid have no common point"),
        ({"inputs": ["\u00b5"], "disturbances": ["\u03bc"]}, ValueError, "the name '\u03bc' stands for two things"),
        ({"continuous": "no"}, TypeError, "continuous is a str; expected True or False"),
        ({"varying": 3}, TypeError, "varying is a int; expected a name, or a list of names"),
        ({"f": "h1"}, TypeError, "f is a str; expected a function"),
        ({"h": {}}, ValueError, "h has no rows; expected at least one sensor"),
        ({"h": lambda x: []}, ValueError, "h has no rows"),
        ({"h": {"y": "h2"}, "inputs": ["pi"]}, ValueError, "the name 'pi' stands for two things"),
    ],
)
def test_a_wrong_type_is_one_error_that_names_the_argument(changes, error, why) -> None:
    with pytest.raises(error, match=why):
        NonlinearModel(**(GIVEN | changes))


# -- where the equations have no value ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("f", "h", "why"),
    [
        ("1 / (x - 2)", "x", "initial: the equation of x is not enclosed, in 1 / .*: it divides by a range that"),
        ("u / (x - 2)", "x", "the equation of x is not enclosed, in quotient: it divides by a range that contains"),
        ("x / (u * 0 + x - 1)", "x", None),
        ("-x", "1 / (x - 2)", "initial: the output y is not enclosed"),
        ("log(x)", "x", "in log: its argument may be zero or negative"),
        ("sqrt(x - 1)", "x", "in sqrt: its argument may be negative"),
        ("(x - 2)**0.3", "x", "in log: its argument may be zero or negative"),
        ("exp(1000 * x)", "x", "in exp: its range is beyond all floats"),
        ("1 / (u - 2)", "x", None),  # nothing is known of the input yet
    ],
)
def test_the_first_set_must_have_values(f: str, h: str, why: str | None) -> None:
    model = scalar(f, h)
    if why is None:
        WindowObserver(model, HPolytope.box([0], [5]))
        return
    with pytest.raises(ValueError, match=why):
        WindowObserver(model, HPolytope.box([0], [5]))
    observer = WindowObserver(model, HPolytope.box([3], [3.5])) if "exp" not in f else None
    if observer is not None:
        observer.update([3.2])
        with pytest.raises(ValueError, match=why):
            observer.reset(HPolytope.box([0], [5]))
        assert observer.window == (0, 0)  # unchanged


def test_a_step_without_an_enclosure_is_undecided_with_sample_and_coordinate_and_goes_on() -> None:
    model = NonlinearModel(
        {"x": "u", "z": "-z + 1 / (3.5 - x)"}, {"y": "x"}, states=["x", "z"], inputs=["u"], n=0.05, Ts=0.1,
        largest=([0, -9], [5, 9]),
    )  # fmt: skip
    observer = WindowObserver(model, HPolytope.box([0.9, -1], [1.1, 1]))
    x, said = 1.0, []
    observer.update([x])
    for k in range(1, 40):
        u = 10.0 if 4 <= k < 7 else -10.0 if 7 <= k < 10 else 0.0
        x += 0.1 * u
        step = observer.step([u], [x])
        said.append(step)
        assert step.verdict != "falsified"
        assert step.box[0][0] - 1e-9 <= x <= step.box[1][0] + 1e-9
    undecided = [step for step in said if step.verdict == "undecided"]
    assert undecided
    assert undecided[0].reason.startswith(f"outside: at sample {undecided[0].sample}, ")
    assert "the equation of z is not enclosed" in undecided[0].reason
    assert said[-1].verdict == "consistent"


def test_a_bank_that_starts_an_observer_where_it_has_no_values_is_undecided_and_goes_on() -> None:
    """The global set reaches where the fault's equations divide by zero: never an error in the middle of a run."""
    common = {"states": ["x"], "inputs": ["u"], "n": 0.05, "Ts": 0.1, "largest": ([0], [5])}
    healthy = NonlinearModel({"x": "u - x"}, {"y": "x"}, **common)
    faulty = NonlinearModel({"x": "u - x + 1 / (x + 0.5)"}, {"y": "x"}, **common)
    start = HPolytope.box([0.9], [1.1])
    bank = ArchitectureII(
        WindowObserver(healthy, start), {"leak": WindowObserver(faulty, start)}, HPolytope.box([-2], [5])
    )
    bank.update([1.0])
    states, x = [], 1.0
    for _ in range(12):
        x += 0.1 * (1.0 - x + 1.0 / (x + 0.5))
        states.append(bank.step([1.0], [x]).state)
    assert states[-1] in ("isolated", "detected")


def test_the_reason_of_an_observer_that_starts_late_has_the_sample_of_the_log_and_an_end_that_is_outside() -> None:
    common = {"states": ["x", "z"], "inputs": ["u"], "n": 0.05, "Ts": 0.1, "largest": ([0, 0], [5, 5])}
    healthy = NonlinearModel({"x": "u - x", "z": "-z"}, {"y": "x"}, **common)
    faulty = healthy.replace(f={"x": "2 * u - x", "z": "-z"}, valid=([-1, -1], [9, 5]))
    start = HPolytope.box([0.9, 0], [1.1, 1])
    leak = {"leak": WindowObserver(faulty, start)}
    bank = ArchitectureII(WindowObserver(healthy, start), leak, HPolytope.box([0, 0], [5, 5]))
    y = np.where(np.arange(16) < 10, 1.0, 3.0)[:, None]  # the leak's observer starts at sample 10
    reason = bank.run(Log(np.arange(16) * 0.1, np.ones((16, 1)), y)).reason
    assert reason is not None
    found = re.fullmatch(r"leak, outside: at sample 11, z may be in \[(.*), (.*)\], outside valid = \[-1, 5\]", reason)
    assert found is not None, reason
    assert float(found[2]) > 5.0
