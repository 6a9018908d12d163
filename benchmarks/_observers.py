"""Observers, plants and tables that the experiments on observers share."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from polytopes import HPolytope
from svo import ConstrainedZonotopeObserver, PolytopeObserver, UncertainModel, WindowObserver

Start = Callable[[UncertainModel, HPolytope], Any]
OBSERVERS: dict[str, Start] = {
    "window": WindowObserver,
    "polytope": PolytopeObserver,
    "zonotope": ConstrainedZonotopeObserver,
}
console = Console(width=150)


def window(horizon: int | None, template: str | np.ndarray = "box") -> Start:
    """Starts window observers of so many steps."""
    return lambda model, initial: WindowObserver(model, initial, horizon=horizon, template=template)


def output_directions(model: UncertainModel, powers: int = 1) -> np.ndarray:
    """Rows C A^-j, j = 0 .. powers: what past outputs say of the present state."""
    stack = model.stack(model.schedule)[0]
    n = model.n_states
    A, C = stack[:n, :n], stack[n:, :n]
    rows = [C]
    for _ in range(powers):
        rows.append(np.linalg.solve(A.T, rows[-1].T).T)
    return np.vstack(rows)


def linear_plant(rng: np.random.Generator, n: int, outputs: int = 2, disturbances: int = 2) -> UncertainModel:
    """A stable random plant without uncertainty, outputs of the size of one."""
    A = rng.normal(size=(n, n))
    A *= rng.uniform(0.7, 0.98) / np.abs(np.linalg.eigvals(A)).max()
    C = rng.normal(size=(outputs, n)) / np.sqrt(n)
    E = rng.normal(size=(n, disturbances)) / np.sqrt(disturbances)
    return UncertainModel(A, None, C, E=E, w=np.full(disturbances, 0.05), n=np.full(outputs, 0.1))


def arguments(module: str, text: str | None, out: bool = True) -> argparse.ArgumentParser:
    """The parser of an experiment; ``--out`` is the folder of its picture."""
    parser = argparse.ArgumentParser(prog=f"python -m benchmarks.{module}", description=(text or "").split("\n")[0])
    if out:
        parser.add_argument("--out", type=Path, default=Path("benchmark_pictures"), help="folder of the picture")
    return parser


def save(figure: Any, folder: Path, name: str) -> None:
    """Write a picture and say where."""
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / name, dpi=130, bbox_inches="tight")
    print(f"picture: {folder / name}")


def table(title: str, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a table, numbers to the right."""
    result = Table(title=title)
    for i, column in enumerate(columns):
        result.add_column(column, justify="left" if i == 0 else "right")
    for row in rows:
        result.add_row(*(str(value) for value in row))
    console.print(result)
