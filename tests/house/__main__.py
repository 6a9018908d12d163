"""``python -m tests.house``: the figures of the house: rooms, floors, circles, arrows, loose files, code."""

from __future__ import annotations

import ast
from statistics import median

from tests.house.imports import ROOT, circles, file_graph, floors, modules, room_graph, tree_of

_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
_TEMPLATES = ("*.j2", "*.css", "*.js")


def product() -> list[ast.Module]:
    """The product's modules; the conformance suite is not counted."""
    return [tree_of(path) for name, path in modules().items() if not name.startswith("svo.testing")]


def statements() -> int:
    """Statements of the product, docstrings not counted."""
    every = [node for tree in product() for node in ast.walk(tree) if isinstance(node, ast.stmt)]
    texts = [node for node in every if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)]
    return len(every) - len(texts)


def template_lines() -> int:
    """Lines of the pages' templates, styles and scripts."""
    files = [path for pattern in _TEMPLATES for path in (ROOT / "svo").rglob(pattern)]
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files)


def function_lengths() -> list[int]:
    """Lines of each function of the product, from its name to its end."""
    nodes = [node for tree in product() for node in ast.walk(tree) if isinstance(node, _FUNCTIONS)]
    return sorted((node.end_lineno or node.lineno) - node.lineno + 1 for node in nodes)


def main() -> None:
    rooms, lengths = room_graph(), function_lengths()
    loose = [name for name in modules() if name.count(".") == 1 and name.startswith("svo.") and not has_parts(name)]
    figures = {
        "rooms": len(rooms),
        "floors": floors(rooms),
        "circles of rooms": len(circles(rooms)),
        "circles of files": len(circles(file_graph())),
        "arrows": sum(map(len, rooms.values())),
        "loose files in svo/": len(loose),
        "statements": statements(),
        "lines of templates": template_lines(),
        "functions": len(lengths),
        "lines of a function, median": median(lengths),
        "lines of a function, longest": lengths[-1],
    }
    for name, value in figures.items():
        print(f"{name:30} {value:g}")
    for circle in [*circles(rooms), *circles(file_graph())]:
        print("circle:", *sorted(circle))


def has_parts(name: str) -> bool:
    """Whether a module is a folder."""
    return modules()[name].name == "__init__.py"


if __name__ == "__main__":
    main()
