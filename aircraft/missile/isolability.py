"""What a signature matrix can tell apart: sets of simultaneous faults, patterns of alarms, sizes of faults."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, combinations

import numpy as np
from numpy.typing import ArrayLike

from aircraft.missile.airframe import INPUTS

FaultSet = tuple[str, ...]


@dataclass(frozen=True)
class IsolabilityTable:
    """Fault sets grouped by the pattern of residuals that they make.

    Attributes
    ----------
    names, residuals : tuple of str
        The faults (columns of the signature matrix) and the residuals (rows).
    groups : tuple of (pattern, fault sets)
        The pattern as a tuple of bool, one a residual. Sets in one group can't be told apart by which residuals react.
    """

    names: tuple[str, ...]
    residuals: tuple[str, ...]
    groups: tuple[tuple[tuple[bool, ...], tuple[FaultSet, ...]], ...]

    @property
    def coinciding(self) -> tuple[tuple[FaultSet, ...], ...]:
        """The groups of more than one fault set."""
        return tuple(sets for _, sets in self.groups if len(sets) > 1)

    def to_text(self) -> str:
        """A table for people, one line a group."""
        total = sum(len(sets) for _, sets in self.groups)
        lines = [f"{len(self.groups)} patterns for {total} fault sets; residuals: {' '.join(self.residuals)}"]
        for pattern, sets in self.groups:
            bits = "".join(str(int(bit)) for bit in pattern)
            lines.append(f"{bits}  {'  '.join('{' + ', '.join(s) + '}' for s in sets)}")
        return "\n".join(lines)


def isolability_table(
    signature: ArrayLike, residuals: Sequence[str], names: Sequence[str] = INPUTS
) -> IsolabilityTable:
    """Group all sets of simultaneous faults by the pattern of residuals that react to them.

    A residual reacts to a set if it depends on any fault in it; that effects of several faults cancel for ever is
    left aside.

    Parameters
    ----------
    signature : (R, F) array of bool
        Which residual depends on which fault.
    residuals, names : sequences of str
        R and F names.
    """
    matrix = np.asarray(signature, dtype=bool)
    if matrix.shape != (len(residuals), len(names)):
        raise ValueError(f"signature has shape {matrix.shape}; expected ({len(residuals)}, {len(names)})")
    groups: dict[tuple[bool, ...], list[FaultSet]] = {}
    for chosen in _subsets(len(names)):
        pattern = tuple(bool(row[list(chosen)].any()) for row in matrix)
        groups.setdefault(pattern, []).append(tuple(names[i] for i in chosen))
    return IsolabilityTable(tuple(names), tuple(residuals), tuple((p, tuple(s)) for p, s in groups.items()))


def diagnoses(conflicts: Sequence[FaultSet | frozenset[str]]) -> tuple[FaultSet, ...]:
    """The smallest fault sets that explain all conflicts, a conflict being faults of which at least one is present.

    A residual that left its bounds is one: at least one fault on which it depends is present. None without conflicts
    but the empty set; none at all if a conflict is empty.
    """
    members = sorted(set(chain.from_iterable(conflicts)), key=lambda name: (*INPUTS, name).index(name))
    for size in range(len(members) + 1):
        found = tuple(chosen for chosen in combinations(members, size) if all(set(chosen) & set(c) for c in conflicts))
        if found:
            return found
    return ()


def identifiable(G: ArrayLike, faults: Sequence[str]) -> bool:
    """Whether e = G (u_a - u_c), (3, 4) G, has one solution if only these inputs are faulty: full column rank."""
    columns = np.asarray(G, dtype=float)[:, [INPUTS.index(name) for name in faults]]
    return not faults or int(np.linalg.matrix_rank(columns)) == len(faults)


def _subsets(count: int) -> list[tuple[int, ...]]:
    return [chosen for size in range(count + 1) for chosen in combinations(range(count), size)]
