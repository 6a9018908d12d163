"""From the user's functions of vectors to tapes of z = (x, w, p, u)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from inspect import Parameter, Signature, signature
from typing import Any, NamedTuple

import numpy as np

from svo.checks import Array
from svo.functions.expression import Expression, Recorder, rows_of, variables
from svo.functions.tape import Tape
from svo.functions.text import parsed

ORDER = "xwpu"  # of the coordinates of z
Function = Callable[..., Any] | Mapping[str, str]
_MEANING = {"x": "states", "u": "inputs", "w": "disturbances", "p": "parameters"}


class Symbols(NamedTuple):
    """Names of states, disturbances, parameters and inputs."""

    x: Sequence[str]
    w: Sequence[str]
    p: Sequence[str]
    u: Sequence[str]


class Sizes(NamedTuple):
    """How many states, disturbances, parameters and inputs there are."""

    x: int
    w: int
    p: int
    u: int


def traced(
    what: str, function: Any, symbols: Symbols, fixed: Array, names: Sequence[str] | None, kept: Sequence[str] = ()
) -> Tape:
    """The tape of a function whose arguments are named u, w and p, and one by any other name, which is the state.

    Parameters
    ----------
    what : str
        Its name, for messages.
    function : callable, or a mapping from the names of its rows to expressions as text
    symbols : Symbols
        Names of the coordinates.
    fixed : (np,) array
        Values of parameters that are constants, NaN for the others.
    names : sequence of str, optional
        Those of the rows; by default as many as it returns.
    kept : sequence of str
        Parameters that are coordinates after the states instead of with the others.

    Raises
    ------
    TypeError, ValueError
        If it is no such function, or does what a tape cannot hold; the message names the function and the row.
    """
    recorder, vectors, first = Recorder(), {}, 0
    sizes = Sizes(*map(len, symbols))
    own = sizes._replace(x=sizes.x + len(kept), p=sizes.p - len(kept))
    for letter, size in zip(ORDER, own, strict=True):
        vectors[letter] = variables(recorder, first, size)
        first += size
    vectors["x"], states = vectors["x"][: sizes.x], iter(vectors["x"][sizes.x :])
    others = iter(vectors["p"])
    vectors["p"] = np.array([next(states if name in kept else others) for name in symbols.p], dtype=object)
    for j in np.flatnonzero(~np.isnan(fixed)):
        vectors["p"][j] = recorder.constant(float(fixed[j]))
    if isinstance(function, Mapping):
        return Tape.of(recorder, _written(what, function, recorder, symbols, vectors, names), first)
    arguments = _arguments(what, function, sizes)
    try:
        found = function(**{name: vectors[letter] for name, letter in arguments.items()})
    except IndexError as error:
        have = ", ".join(f"{getattr(sizes, k)} {_MEANING[k]}" for k in arguments.values())
        raise ValueError(f"{what} reads an entry that is not there ({error}); there are {have}") from error
    except (TypeError, ValueError) as error:
        kind = TypeError if isinstance(error, TypeError) else ValueError
        hint = "; expected the functions of svo.functions, not numpy's" if "ufunc" in str(error) else ""
        raise kind(f"{what}: {error}{hint}") from error
    except (ArithmeticError, AttributeError, LookupError, NameError, RecursionError) as error:
        raise ValueError(f"{what} cannot be traced, {type(error).__name__}: {error}") from error
    if names is None:
        found = found if isinstance(found, Iterable) else [found]
        found = list(found)
        names = [f"y[{i}]" for i in range(len(found))]
    return Tape.of(recorder, rows_of(what, found, recorder, names), first)


def with_kept(tape: Tape, n: int, kept: int, continuous: bool) -> Tape:
    """The tape of f of n states with rows for parameters that are kept: zero, or in discrete time as they are."""
    if not kept:
        return tape
    recorder = Recorder()
    z = list(variables(recorder, 0, tape.variables))
    rest = [recorder.constant(0.0)] * kept if continuous else z[n : n + kept]
    return Tape.of(recorder, [*tape.record(z, recorder), *rest], tape.variables)


class OfVectors:
    """A function of x, w, p and u as one whose arguments are those of them that a model has."""

    def __init__(self, function: Callable[..., Any], symbols: Symbols) -> None:
        self.function = function
        self.letters = [letter for letter, names in zip(ORDER, symbols, strict=True) if names]
        self.__signature__ = Signature([Parameter(letter, Parameter.KEYWORD_ONLY) for letter in self.letters])

    def __call__(self, **vectors: Any) -> Any:
        return self.function(**{letter: vectors.get(letter, np.zeros(0)) for letter in ORDER})


class Retraced:
    """A function of x, w, p and u as the tape that it was traced to, with every parameter a coordinate."""

    def __init__(self, tape: Tape) -> None:
        self.tape = tape

    def __call__(self, **vectors: Any) -> Any:
        """Rows of expressions, or of numbers."""
        z = np.concatenate([vectors[letter] for letter in ORDER])
        first = next((v for v in z if isinstance(v, Expression)), None)
        return self.tape.values(z) if first is None else self.tape.record(list(z), first.recorder)


def retraced(what: str, function: Any, symbols: Symbols, names: Sequence[str] | None) -> OfVectors:
    """A function of a model as what it was traced to: a pickle can hold it, and other functions be made of it."""
    if isinstance(function, OfVectors) and isinstance(function.function, Retraced):
        return function
    free = np.full(len(symbols.p), np.nan)
    return OfVectors(Retraced(traced(what, function, symbols, free, names)), symbols)


def _written(
    what: str,
    rows: Mapping[Any, Any],
    recorder: Recorder,
    symbols: Symbols,
    vectors: Mapping[str, Any],
    names: Sequence[str] | None,
) -> list[Expression]:
    """Rows that are written as text, in the order of their names."""
    names = list(rows) if names is None else names
    if set(rows) != set(names):
        missing, more = [n for n in names if n not in rows], [n for n in rows if n not in names]
        raise ValueError(
            f"{what} has no row for {', '.join(missing)}"
            if missing
            else f"{what} has a row for {more[0]!r:.80}; expected one each for {', '.join(names)}"
        )
    known = {
        name: vector
        for letter, own in zip(ORDER, symbols, strict=True)
        for name, vector in zip(own, vectors[letter], strict=True)
    }
    return [parsed(f"{what}, row {name}", rows[name], recorder, known) for name in names]


def _arguments(what: str, function: Any, sizes: Sizes) -> Mapping[str, str]:
    """Which vector each argument of a function stands for."""
    if not callable(function):
        raise TypeError(f"{what} is a {type(function).__name__}; expected a function such as def {what}(x, u): ...")
    kinds = (Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY)
    given = [p for p in signature(function).parameters.values() if p.default is Parameter.empty]
    named = {p.name: p.name if p.name in "uwp" else "x" for p in given}
    if not all(p.kind in kinds for p in given) or list(named.values()).count("x") > 1:
        shown = ", ".join(map(str, signature(function).parameters.values()))
        raise TypeError(
            f"{what} has the arguments ({shown}); expected any of u (inputs), w (disturbances) and p (parameters) by "
            "these names, and one more, by any name, for the states"
        )
    for letter in named.values():
        if not getattr(sizes, letter):
            raise ValueError(f"{what} has an argument {letter!r}, but the model has no {_MEANING[letter]}")
    return named
