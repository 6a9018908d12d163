"""Which of its banks a plant is asked for: its architecture, and the kind of its observers' models."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

from svo.plant.protocol import MonitoredPlant, Plant


@runtime_checkable
class OffersArchitectures(Protocol):
    """What a `Plant` offers besides if its bank can be built in more than one way.

    Attributes
    ----------
    architecture : str
        Of the plant's own `bank`.
    architectures : tuple of str
        All that there are.
    """

    architecture: str
    architectures: tuple[str, ...]

    def with_architecture(self, architecture: str) -> Plant:
        """The same plant with the bank of another architecture."""
        ...


@runtime_checkable
class OffersModels(Protocol):
    """What a `Plant` offers besides if its observers can have models of more than one kind.

    Attributes
    ----------
    model_kind : str
        Of the plant's own `bank`.
    model_kinds : tuple of str
        All that there are.
    """

    model_kind: str
    model_kinds: tuple[str, ...]

    def with_models(self, kind: str) -> Plant:
        """The same plant with a bank whose observers have models of another ``kind``."""
        ...


class BankChoice(NamedTuple):
    """Which bank of a plant; None where the plant has one kind only.

    Attributes
    ----------
    architecture : str or None
    models : str or None
        Kind of the observers' models.
    """

    architecture: str | None = None
    models: str | None = None

    @property
    def title(self) -> str:
        """For people; empty where there is no choice."""
        words = [] if self.architecture is None else [f"Architecture {self.architecture}"]
        return ", ".join(words if self.models is None else [*words, f"{self.models} models"])


ONLY_BANK = BankChoice()  # of a plant that has one kind


def what_differs(choices: Iterable[BankChoice]) -> tuple[BankChoice, ...]:
    """The different ones of ``choices`` in order, without what is the same in all of them."""
    every = list(dict.fromkeys(choices))
    same = [len(set(values)) < 2 for values in zip(*every, strict=True)]
    return tuple(BankChoice(*(None if s else v for s, v in zip(same, choice, strict=True))) for choice in every)


def bank_choice(plant: MonitoredPlant) -> BankChoice:
    """Which bank a ``plant`` gives."""
    return BankChoice(
        plant.architecture if isinstance(plant, OffersArchitectures) else None,
        plant.model_kind if isinstance(plant, OffersModels) else None,
    )


def with_bank(plant: Any, choice: BankChoice) -> Any:
    """The ``plant`` with the bank of a ``choice``; None in it = its own.

    Raises
    ------
    ValueError
        If the plant offers no such choice, or not this one.
    """
    architecture, models = choice
    if architecture is not None:
        offered = plant.architectures if isinstance(plant, OffersArchitectures) else ()
        _check("architecture", architecture, plant.name, offered)
        plant = plant.with_architecture(architecture)
    if models is not None:
        offered = plant.model_kinds if isinstance(plant, OffersModels) else ()
        _check("kind of models", models, plant.name, offered)
        plant = plant.with_models(models)
    return plant


def architecture_of(plant: MonitoredPlant) -> str | None:
    """The architecture of a ``plant``'s bank; None if the plant has one kind of bank only."""
    return bank_choice(plant).architecture


def in_architecture(plant: Any, architecture: str | None) -> Any:
    """The ``plant`` with the bank of an ``architecture``, as `with_bank`."""
    return with_bank(plant, BankChoice(architecture))


def _check(what: str, name: str, plant: str, offered: Sequence[str]) -> None:
    if not offered:
        raise ValueError(f"plant {plant!r} has one {what} only; leave the choice out")
    if name not in offered:
        raise ValueError(f"plant {plant!r} has no {what} {name!r}; it has {', '.join(offered)}")
