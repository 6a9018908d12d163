"""What a study runs: its configuration, the list of its runs, and the seed of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from itertools import product, starmap
from typing import Any

import numpy as np

from polytopes.shown import Shown
from svo.checks import expect
from svo.plant import HEALTHY, BankChoice, Plant, bank_choice, chosen_noise, with_bank
from svo.plant.choice import ONLY_BANK


@dataclass(frozen=True)
class Job:
    """One run of a study.

    Attributes
    ----------
    run : int
        Number of the run, from 0, in the order of the study.
    fault, profile, noise : str
        ``fault`` and ``profile`` are both "none" in a fault-free run.
    seed : int
        Seed of this run alone: ``svo simulate`` with it makes the same log.
    exemplary : bool
        Whether the run is the one of its kind whose samples are kept for the pictures.
    bank : BankChoice
        Which of the plant's banks.
    """

    run: int
    fault: str
    profile: str
    noise: str
    seed: int
    exemplary: bool
    bank: BankChoice = ONLY_BANK


@dataclass(frozen=True)
class StudyConfiguration(Shown):
    """Everything that the results of a study depend on, besides the versions of the software.

    Attributes
    ----------
    plant : str
        Name in the registry of plants.
    noise : tuple of str
        Noise sets.
    faults : tuple of str
        Names of faults; "none" stands for the fault-free runs.
    runs : int
        Runs of each noise set, fault and profile.
    seed : int
        The seed that all others are spawned from.
    architectures : tuple of str
        Of the plant's bank; empty for a plant that has one kind of bank only. All see the same flights.
    models : tuple of str
        Kinds of the observers' models, likewise.
    """

    plant: str
    noise: tuple[str, ...]
    faults: tuple[str, ...]
    runs: int
    seed: int
    architectures: tuple[str, ...] = ()
    models: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        expect(self.runs >= 1, "runs", self.runs, "at least 1 run of each fault and profile")
        expect(self.seed >= 0, "seed", self.seed, "an integer >= 0")
        for name in ("noise", "faults"):
            values = getattr(self, name)
            expect(values and len(set(values)) == len(values), name, values, "one or more different names")
        for name in ("architectures", "models"):
            values = getattr(self, name)
            expect(len(set(values)) == len(values), name, values, "different names")

    @classmethod
    def for_plant(
        cls,
        plant: Plant,
        *,
        runs: int,
        seed: int,
        noise: Sequence[str] = (),
        faults: Sequence[str] = (),
        architectures: Sequence[str] = (),
        models: Sequence[str] = (),
    ) -> StudyConfiguration:
        """A configuration checked against a plant.

        Without ``noise`` it has the plant's default noise set, without ``faults`` all faults and the fault-free runs,
        without ``architectures`` or ``models`` the plant's own.

        Raises
        ------
        ValueError
            If the plant has no noise set, fault, architecture or kind of models of a name; the message lists those that
            it has.
        """
        noise = tuple(noise) or plant.noise_sets[:1]
        faults = tuple(faults) or (HEALTHY, *plant.faults)
        for name in noise:
            chosen_noise(plant, name)
        for name in faults:
            if name != HEALTHY:
                check_fault(plant, name)
        for choice in (*(BankChoice(name) for name in architectures), *(BankChoice(models=kind) for kind in models)):
            with_bank(plant, choice)
        own = bank_choice(plant)
        names, kinds = (
            tuple(asked) or (() if mine is None else (mine,))
            for asked, mine in ((architectures, own.architecture), (models, own.models))
        )
        return cls(plant.name, noise, faults, runs, seed, architectures=names, models=kinds)

    @classmethod
    def from_dict(cls, stored: Mapping[str, Any]) -> StudyConfiguration:
        """What `to_dict` gave.

        Raises
        ------
        ValueError
            Naming the key that is missing, unknown, or has a value of another kind.
        """
        known = {f.name: f.type for f in fields(cls)}
        missing, unknown = sorted(known.keys() - stored.keys()), sorted(stored.keys() - known.keys())
        if missing or unknown:
            what = f"lacks {missing[0]!r}" if missing else f"has the unknown key {unknown[0]!r}"
            raise ValueError(f"the configuration {what}; expected {', '.join(known)}")
        for name, kind in known.items():
            _check_kind(name, stored[name], str(kind))
        given: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in stored.items()}
        return cls(**given)

    def jobs(self, plant: Plant) -> list[Job]:
        """The runs in their order.

        The seed of a run depends on the study's seed, on the run's place among those of its kind, and on nothing
        else: neither on the number of runs nor on which faults, noise sets and banks were chosen.
        """
        every = [(n, f, p) for n in plant.noise_sets for f, p in conditions(plant)]
        jobs: list[Job] = []
        for (noise, fault, profile), parent in zip(
            every, np.random.SeedSequence(self.seed).spawn(len(every)), strict=True
        ):
            if noise not in self.noise or fault not in self.faults:
                continue
            # 53 bits: an integer that JSON readers keep exactly.
            seeds = [int(c.generate_state(1, np.uint64)[0] >> np.uint64(11)) for c in parent.spawn(self.runs)]
            jobs += [
                Job(len(jobs) + j, fault, profile, noise, seeds[i], exemplary=i == 0, bank=bank)
                for j, (bank, i) in enumerate(product(self.banks, range(self.runs)))
            ]
        return jobs

    @property
    def banks(self) -> tuple[BankChoice, ...]:
        """Which banks see each run."""
        return tuple(starmap(BankChoice, product(self.architectures or (None,), self.models or (None,))))

    def to_dict(self) -> dict[str, Any]:
        """A form for JSON; lists instead of tuples."""
        return {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(self).items()}


def _check_kind(name: str, value: Any, kind: str) -> None:
    right = {
        "str": isinstance(value, str),
        "int": isinstance(value, int) and not isinstance(value, bool),
        "tuple[str, ...]": isinstance(value, list) and all(isinstance(v, str) for v in value),
    }
    if not right[kind]:
        expected = {"str": "a text", "int": "an integer"}.get(kind, "a list of texts")
        raise ValueError(f"{name} of the configuration is {value!r:.100}; expected {expected}")


def conditions(plant: Plant) -> list[tuple[str, str]]:
    """(fault, profile) of a plant, ("none", "none") first."""
    return [(HEALTHY, HEALTHY), *((fault, profile) for fault, profiles in plant.faults.items() for profile in profiles)]


def check_fault(plant: Plant, fault: str, profile: str | None = None) -> None:
    """Raise a ValueError if the plant has no fault, or that fault no profile, of that name."""
    if fault not in plant.faults:
        raise ValueError(
            f"plant {plant.name!r} has no fault {fault!r}; it has {', '.join(plant.faults)} (and {HEALTHY!r})"
        )
    if profile is not None and profile not in plant.faults[fault]:
        raise ValueError(f"fault {fault!r} has no profile {profile!r}; it has {', '.join(plant.faults[fault])}")
