"""The cart of the documentation with a `[log]` table of its own, for logs of any dialect."""

from __future__ import annotations

from pathlib import Path

from svo.logs.dialect.read import Reading, read_dialect
from svo.plant.description import DescribedPlant, read_description

EXAMPLE = Path(__file__).parents[4] / "docs" / "examples" / "cart.toml"


def cart(folder: Path, table: str, *, Ts: float = 0.1, change: tuple[str, str] = ("", "")) -> DescribedPlant:
    """The cart whose logs are written as a table states, and with another text changed in its description."""
    text = EXAMPLE.read_text(encoding="utf-8").replace("Ts = 0.1 ", f"Ts = {Ts} ").replace(*change)
    file = folder / "my_cart.toml"
    file.write_text(text.replace("[model]", f"{table}\n[model]", 1), encoding="utf-8")
    return read_description(file)


def reading(path: Path, table: str, folder: Path, *, Ts: float = 0.1) -> Reading:
    """A log as the table states it."""
    plant = cart(folder, table, Ts=Ts)
    assert plant.dialect is not None
    return read_dialect(path, plant.columns, plant.Ts, plant.dialect)


def written(folder: Path, text: str | bytes, table: str, *, Ts: float = 0.1, name: str = "log.txt") -> Reading:
    """A log with that text, as the table states it."""
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return reading(path, table, folder, Ts=Ts)
