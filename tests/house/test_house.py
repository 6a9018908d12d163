"""The house stands as `docs/architecture.md` draws it: rooms import leftwards only, and nothing hides."""

from __future__ import annotations

import ast

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
    "polytopes", "checks", "indices", "terminal", "store", "pictures", "pages", "logs", "functions", "models", "faults",
    "observers", "interval", "residual_tests", "baselines", "isolation", "detectors", "plant", "analysis", "detection",
    "studies", "testing", "cli",
)  # fmt: skip
CLOSED_TO_PLANTS = {"analysis", "detection", "studies", "testing", "cli"}


def test_rooms_import_only_leftwards() -> None:
    assert set(room_graph()) <= {*ORDER, "aircraft"}, "a new room: give it a place in ORDER and in docs/architecture.md"
    left = {room: set(ORDER[: ORDER.index(room)]) for room in room_graph() if room in ORDER}
    left["aircraft"] = set(ORDER) - CLOSED_TO_PLANTS
    assert not {room: sorted(others - left[room]) for room, others in room_graph().items() if others - left[room]}


def test_rooms_import_in_no_circle() -> None:
    assert not circles(room_graph())


def test_files_import_in_no_circle() -> None:
    assert not circles(file_graph())


def test_the_rule_sees_a_circle_and_counts_floors() -> None:
    graph = {"a": frozenset("b"), "b": frozenset("c"), "c": frozenset("b"), "d": frozenset("a")}
    assert circles(graph) == [frozenset("bc")]
    assert floors(graph) == 3


def test_nothing_reaches_for_another_modules_underscore() -> None:
    reaches = {(module, other, name) for module in modules() for other, name in imported_by(module) if other != module}
    assert not {r for r in reaches if (r[2] or r[1].rpartition(".")[2]).startswith("_")}


def test_no_submodule_has_the_name_of_an_exported_function() -> None:
    packages = [name for name, path in modules().items() if path.name == "__init__.py"]
    assert not {f"{p}.{name}" for p in packages for name in exported(p)} & set(modules())


def exported(package: str) -> set[str]:
    """What the face of a package lists."""
    for node in tree_of(modules()[package]).body:
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "__all__":
            return set(ast.literal_eval(node.value))
    return set()


def test_one_loop_goes_over_a_log() -> None:
    """Only `svo.logs.drive` hands the input of the sample before to a step."""
    nodes = [(module, node) for module, path in modules().items() for node in ast.walk(tree_of(path))]
    calls = [(module, node) for module, node in nodes if isinstance(node, ast.Call) and node.args]
    steps = [(m, node) for m, node in calls if isinstance(node.func, ast.Attribute) and node.func.attr == "step"]
    assert not [(m, ast.unparse(node)) for m, node in steps if ast.unparse(node.args[0]).endswith("[k - 1]")]


def test_one_file_names_highs() -> None:
    named = {
        module
        for module, path in modules().items()
        for node in ast.walk(tree_of(path))
        if (isinstance(node, ast.Import) and any(a.name.split(".")[0] == "highspy" for a in node.names))
        or (isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "highspy")
    }
    assert named == {"polytopes.highs"}
