"""Rules of conformance: what each says, how it is checked, and the error that names the one that is broken."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Generic, TypeVar

from polytopes.shown import Shown

Subject = TypeVar("Subject")


class ConformanceError(AssertionError):
    """A ``rule`` is broken.

    Attributes
    ----------
    rule, says : str
        Its name, and what it demands.
    found : str
        What was seen instead.
    advice : str
        What to do.
    """

    def __init__(self, rule: Rule, found: str) -> None:
        self.rule, self.says, self.found, self.advice = rule.name, rule.says, found, rule.advice
        super().__init__(f"rule {rule.name!r} is broken: {found}; the rule: {rule.says}; what to do: {rule.advice}")


class NotApplicable(Exception):
    """Why a rule cannot be asked of this subject."""


@dataclass(frozen=True)
class Rule(Shown, Generic[Subject]):
    """One demand.

    Attributes
    ----------
    name, says, advice : str
        Its key, the demand in a sentence, and what to do about a breach.
    breaches : callable
        Yields a sentence for each breach that it sees; may raise `NotApplicable`.
    """

    name: str
    says: str
    advice: str
    breaches: Callable[[Subject], Iterator[str]]

    def check(self, subject: Subject) -> None:
        """Ask the rule of a subject: a `Kind` of observer, or the `PlantRuns` of a plant.

        Raises
        ------
        ConformanceError
            At the first breach; whatever else the subject raises is one.
        NotApplicable
            If the subject does not offer what the rule asks for.
        """
        try:
            found = next(iter(self.breaches(subject)), None)
        except (NotApplicable, ConformanceError):
            raise
        except (Exception, SystemExit) as error:  # sys.exit(0) would end the caller's tests as if all held
            raise ConformanceError(self, f"{type(error).__name__}: {error}") from error
        if found is not None:
            raise ConformanceError(self, found)


@dataclass(frozen=True)
class Conformance(Shown):
    """What a check asked.

    Attributes
    ----------
    kept : tuple of str
        Names of the rules that hold.
    left_out : mapping of str to str
        Why the others could not be asked.
    """

    kept: tuple[str, ...]
    left_out: Mapping[str, str]


def rule(says: str, *, advice: str) -> Callable[[Callable[[Subject], Iterator[str]]], Rule[Subject]]:
    """Make a rule of a function that yields breaches; it has the function's name, in words."""

    def named(breaches: Callable[[Subject], Iterator[str]]) -> Rule[Subject]:
        return Rule(breaches.__name__.replace("_", " "), says, advice, breaches)

    return named


def table(*rules: Rule[Subject]) -> Mapping[str, Rule[Subject]]:
    """Rules by their names, in the order in which they are asked."""
    return MappingProxyType({each.name: each for each in rules})


def keep(rules: Collection[Rule[Subject]], subject: Subject) -> Conformance:
    """Ask every rule in turn.

    Raises
    ------
    ConformanceError
        At the first that is broken.
    """
    kept, left_out = [], {}
    for each in rules:
        try:
            each.check(subject)
            kept.append(each.name)
        except NotApplicable as reason:
            left_out[each.name] = str(reason)
    return Conformance(tuple(kept), left_out)
