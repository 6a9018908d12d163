from __future__ import annotations

import pytest

from svo.plant import load_plant
from svo.store import versions
from svo.studies.configuration import StudyConfiguration, check_fault


def seeds(tank: str, **changes: object) -> dict[tuple[str, str, str, int], int]:
    plant = load_plant(tank)
    given = {"runs": 3, "seed": 7, "noise": ("calm", "rough")} | changes
    jobs = StudyConfiguration.for_plant(plant, **given).jobs(plant)  # type: ignore[arg-type]
    found: dict[tuple[str, str, str, int], int] = {}
    for job in jobs:
        kind = (job.noise, job.fault, job.profile)
        found[(*kind, sum(key[:3] == kind for key in found))] = job.seed
    return found


def test_a_study_has_every_fault_and_profile_and_fault_free_runs(registered_tank: str) -> None:
    plant = load_plant(registered_tank)
    jobs = StudyConfiguration.for_plant(plant, runs=2, seed=0).jobs(plant)
    kinds = [(job.noise, job.fault, job.profile) for job in jobs]
    expected = [("none", "none"), ("leak", "step"), ("leak", "ramp"), ("gauge", "step")]
    assert kinds == [("calm", *kind) for kind in expected for _ in range(2)]
    assert [job.run for job in jobs] == list(range(8))
    assert [job.exemplary for job in jobs] == [True, False] * 4


def test_seeds_differ_and_do_not_depend_on_what_else_is_run(registered_tank: str) -> None:
    every = seeds(registered_tank)
    assert len(set(every.values())) == len(every) == 2 * 4 * 3
    assert max(every.values()) < 2**53
    more_runs = seeds(registered_tank, runs=5)
    assert {key: more_runs[key] for key in every} == every
    for part in ({"noise": ("rough",)}, {"faults": ("gauge", "none")}):
        chosen = seeds(registered_tank, **part)
        assert chosen
        assert chosen.items() <= every.items()
    assert seeds(registered_tank, seed=8).keys() == every.keys()
    assert not set(seeds(registered_tank, seed=8).values()) & set(every.values())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"runs": 0}, "runs is 0"),
        ({"seed": -1}, "seed is -1"),
        ({"noise": ("loud",)}, "no noise set 'loud'; it has calm, rough"),
        ({"faults": ("rust",)}, "no fault 'rust'; it has leak, gauge"),
        ({"noise": ("calm", "calm")}, "different names"),
    ],
)
def test_a_wrong_configuration_says_what_it_should_be(
    registered_tank: str, changes: dict[str, object], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        seeds(registered_tank, **changes)


def test_profiles_are_checked(registered_tank: str) -> None:
    with pytest.raises(ValueError, match="fault 'leak' has no profile 'soft'; it has step, ramp"):
        check_fault(load_plant(registered_tank), "leak", "soft")


def test_versions_name_the_software(registered_tank: str) -> None:
    assert {"svo-fdi", "numpy", "python", "machine"} <= versions().keys()
