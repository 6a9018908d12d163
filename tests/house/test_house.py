"""The house stands as `docs/architecture.md` draws it: rooms import leftwards only, and nothing hides."""

from __future__ import annotations

import ast

import pytest

from tests.house.imports import (
    circles,
    file_graph,
    floors,
    imported_by,
    modules,
    room_graph,
    tree_of,
)

ORDER = (
    "polytopes", "checks", "indices", "terminal", "store", "logs", "models", "faults", "observers", "interval",
    "residual_tests", "baselines", "isolation", "detectors", "plant", "analysis", "detection", "studies", "testing",
    "cli",
)  # fmt: skip
CLOSED_TO_PLANTS = {"analysis", "detection", "studies", "testing", "cli"}


@pytest.mark.parametrize("room", sorted(room_graph()))
def test_a_room_imports_only_leftwards(room: str) -> None:
    if room == "aircraft":
        assert not room_graph()[room] & CLOSED_TO_PLANTS
        return
    assert room in ORDER, f"{room} is new: give it its place in ORDER and in docs/architecture.md"
    left = ORDER[: ORDER.index(room)]
    assert room_graph()[room] <= set(left)


def test_rooms_import_in_no_circle() -> None:
    assert not circles(room_graph())


@pytest.mark.xfail(strict=True, raises=AssertionError, reason="in observers.window and studies.comparison")
def test_files_import_in_no_circle() -> None:
    assert not circles(file_graph())


def test_the_rule_sees_a_circle_and_counts_floors() -> None:
    graph = {"a": frozenset("b"), "b": frozenset("c"), "c": frozenset("b"), "d": frozenset("a")}
    assert circles(graph) == [frozenset("bc")]
    assert floors(graph) == 3


@pytest.mark.parametrize("module", sorted(modules()))
def test_nothing_reaches_for_another_modules_underscore(module: str) -> None:
    taken = {(other, name) for other, name in imported_by(module) if name and name.startswith("_")}
    taken |= {(other, None) for other, _ in imported_by(module) if other.rpartition(".")[2].startswith("_")}
    assert not {pair for pair in taken if pair[0] != module}


PACKAGES = sorted({name for name, path in modules().items() if path.name == "__init__.py"})
WAITING = pytest.mark.xfail(strict=True, raises=AssertionError, reason="its studies share one engine next")


@pytest.mark.parametrize(
    "package", [pytest.param(p, marks=WAITING if p == "svo.studies.thresholds" else ()) for p in PACKAGES]
)
def test_no_submodule_has_the_name_of_an_exported_function(package: str) -> None:
    inner = {name.removeprefix(f"{package}.") for name in modules() if name.startswith(f"{package}.")}
    assert not exported(package) & inner


def exported(package: str) -> set[str]:
    """What the face of a package lists."""
    for node in tree_of(modules()[package]).body:
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "__all__":
            return set(ast.literal_eval(node.value))
    return set()
