"""Plants that installed distributions register in the entry-point group ``svo.plants``."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any

from svo.plant.protocol import Plant


def registered_plants() -> dict[str, Callable[[], Plant]]:
    """Loaders of the plants that installed distributions register, by name."""
    return {point.name: point.load for point in sorted(entry_points(group="svo.plants"), key=lambda p: p.name)}


def load_plant(name: str) -> Plant:
    """The registered plant of that name.

    Raises
    ------
    ValueError
        If no plant of that name is registered; the message lists those that are.
    ImportError
        If its module cannot be imported, or has no such name.
    TypeError
        If the entry point does not return a `Plant`; the message lists what is missing.
    """
    loaders = registered_plants()
    if name not in loaders:
        known = ", ".join(loaders) or "none"
        raise ValueError(f"no plant is registered as {name!r} in the entry-point group svo.plants; registered: {known}")
    return made_by(loaders[name], name)


def made_by(loader: Callable[[], Any], name: str) -> Plant:
    """The plant of one of the `registered_plants`; errors as of `load_plant`."""
    try:
        factory: Any = loader()
    except (ImportError, AttributeError) as error:
        raise ImportError(f"plant {name!r} of group svo.plants cannot be loaded: {error}") from error
    plant = factory() if callable(factory) and not isinstance(factory, Plant) else factory
    if not isinstance(plant, Plant):
        expected = [*Plant.__annotations__, *(key for key, value in vars(Plant).items() if callable(value))]
        missing = [key for key in expected if not (key.startswith("_") or hasattr(plant, key))]
        raise TypeError(
            f"entry point {name!r} of group svo.plants gave {type(plant).__name__}, which is not a Plant: "
            f"it lacks {', '.join(missing)}"
        )
    return plant
