"""The numbers of a channel, in the model's unit, NaN where a row has no reading."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from svo.checks import Array
from svo.logs.dialect.block import Block
from svo.logs.dialect.numbers import Marks, numbers_of
from svo.logs.dialect.rules import Channel, Dialect, Valid, Which
from svo.logs.dialect.source import Cells
from svo.logs.dialect.units import conversion


def values_of(block: Block, which: Which, dialect: Dialect, rule: Channel, unit: str) -> Array:
    """Numbers (rows of the block,) in the model's ``unit``.

    Raises
    ------
    ValueError
        Naming the line and the column.
    """
    source = block.source
    cells = source.column(which)
    good = np.flatnonzero(good_rows(block, rule.valid or dialect.valid))
    rows = [block.rows[i] for i in good.tolist()]
    label = source.label(which)

    def where(i: int) -> str:
        return f"{source.source}, {source.place(rows[i])}, {label}"

    values = np.full(len(block.rows), np.nan)
    if isinstance(cells, np.ndarray):
        values[good] = _of_numbers(cells, rows, where, dialect, rule)
    else:
        values[good] = numbers_of([cells[row] for row in rows], where, dialect, rule)
    factor, offset = in_model_units(rule, unit)
    if (factor, offset) == (1.0, 0.0):
        return values
    with np.errstate(over="ignore"):
        converted = np.asarray(values * factor + offset, dtype=float)
    for i in np.flatnonzero(np.isinf(converted))[:1].tolist():
        raise ValueError(
            f"{source.source}, {source.place(block.rows[i])}, {label}: {values[i]:g} is beyond all floats after scale "
            "and offset"
        )
    return converted


def in_model_units(rule: Channel, unit: str) -> tuple[float, float]:
    """Factor and offset from numbers of a file to the model's ``unit``."""
    factor, offset = (1.0, 0.0) if rule.unit is None else conversion(rule.unit, unit)
    return rule.scale * factor, rule.offset * factor + offset


def good_rows(block: Block, valid: Valid | None) -> np.ndarray:
    """Which rows hold a reading that counts."""
    if valid is None:
        return np.ones(len(block.rows), dtype=bool)
    flags, good = block.source.column(valid.column), {_flag(text) for text in valid.good}
    return np.array([_flag(flags[row]) in good for row in block.rows], dtype=bool)


def _flag(cell: object) -> float | str:
    """What a flag says: 1 and 1.0 are the same, and so are true, TRUE and a 1 of truth values."""
    try:
        return float(cell)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        text = str(cell).strip()
        return {"true": 1.0, "false": 0.0}.get(text.lower(), text)


def _of_numbers(
    cells: Cells, rows: Sequence[int], where: Callable[[int], str], dialect: Dialect, rule: Channel
) -> Array:
    if rule.number is not None and rows:
        raise ValueError(f"{where(0)}: a number, not text; drop number = {rule.number!r} of the channel")
    values = np.array(cells, dtype=float)[list(rows)]
    missing = [float(text) for text in (*dialect.missing, *rule.missing) if Marks().plain(text)]
    values[np.isin(values, [*dialect.sentinels, *rule.sentinels, *missing])] = np.nan
    for i in np.flatnonzero(np.isinf(values))[:1].tolist():
        raise ValueError(f"{where(i)}: {values[i]} is no reading; list it in sentinels if it means that there is none")
    return values
