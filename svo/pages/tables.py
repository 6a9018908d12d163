"""Tables as rows of text, for the terminal and for pages alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table


@dataclass(frozen=True)
class TextTable:
    """A table of text; the first ``labels`` columns are names, the others figures."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    labels: int


def to_rich(table: TextTable) -> Table:
    """The table for a terminal."""
    from rich import box
    from rich.table import Table

    rich_table = Table(
        title=table.title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0)
    )
    for i, name in enumerate(table.header):
        rich_table.add_column(name, justify="left" if i < table.labels else "right", no_wrap=True)
    for row in table.rows:
        rich_table.add_row(*row)
    return rich_table
