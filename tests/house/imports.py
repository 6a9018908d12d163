"""Who imports whom: the modules of the three packages, their rooms, and the arrows between them."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("polytopes", "svo", "aircraft")
Graph = Mapping[str, frozenset[str]]


@cache
def modules() -> dict[str, Path]:
    """Every module of the packages by its dotted name; a package has the name of its folder."""
    found = {}
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def imported_by(module: str) -> Iterator[tuple[str, str | None]]:
    """Each import of ours in a module, wherever it stands: the module imported, and the name taken from it."""
    for node in ast.walk(tree_of(modules()[module])):
        if isinstance(node, ast.ImportFrom) and node.module in modules():
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield (inner, None) if inner in modules() else (node.module, alias.name)
        elif isinstance(node, ast.Import):
            yield from ((alias.name, None) for alias in node.names if alias.name in modules())


def room_of(module: str) -> str:
    """The folder or loose file at the top of ``svo`` that holds a module; the other packages are one room each."""
    first, *rest = module.split(".")
    return rest[0] if first == "svo" and rest else first


@cache
def file_graph() -> Graph:
    return {module: frozenset(other for other, _ in imported_by(module)) - {module} for module in modules()}


@cache
def room_graph() -> Graph:
    """Rooms and the rooms that they import; the face of ``svo`` and its entry point are no rooms."""
    graph: dict[str, set[str]] = {}
    for module, others in file_graph().items():
        if room_of(module) not in ("svo", "__main__"):
            graph.setdefault(room_of(module), set()).update(map(room_of, others))
    return {room: frozenset(others - {room, "svo"}) for room, others in graph.items()}


def circles(graph: Graph) -> list[frozenset[str]]:
    """Sets of nodes that reach one another, as of Tarjan (1972)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[frozenset[str]] = []

    def visit(node: str) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in graph[node]:
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            circle = frozenset(stack[stack.index(node) :])
            del stack[stack.index(node) :]
            found.append(circle)

    for node in graph:
        if node not in index:
            visit(node)
    return [circle for circle in found if len(circle) > 1]


def floors(graph: Graph) -> int:
    """Length of the longest way down, every circle taken for one node."""
    whole = {node: circle for circle in circles(graph) for node in circle}
    name = {node: min(whole.get(node, {node})) for node in graph}
    joined: dict[str, set[str]] = {}
    for node, others in graph.items():
        joined.setdefault(name[node], set()).update({name[other] for other in others} - {name[node]})
    height: dict[str, int] = {}
    for node in TopologicalSorter(joined).static_order():
        height[node] = 1 + max((height[other] for other in joined[node]), default=0)
    return max(height.values())
