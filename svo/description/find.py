"""A plant by what a user types: the name of a registered one, or the path of a TOML file."""

from __future__ import annotations

import shutil
from pathlib import Path

from svo.description.plant import DescribedPlant, read_description
from svo.plant import MonitoredPlant, load_plant, registered_plants

SUFFIX = ".toml"


def find_plant(name: str, folder: Path = Path()) -> MonitoredPlant:
    """The plant described in ``name`` if that ends in .toml (relative to ``folder``), else the registered one.

    Raises
    ------
    ValueError
        If no plant is registered by that name, or the description has a mistake.
    OSError
        If the file cannot be opened.
    """
    if name.endswith(SUFFIX):
        return read_description(folder / name)
    if name not in registered_plants() and (folder / name).is_file():
        raise ValueError(f"{name} is a file, and no plant is registered by that name; a description ends in {SUFFIX}")
    return load_plant(name)


def keep_description(plant: MonitoredPlant, folder: Path) -> None:
    """Copy the files that describe a plant beside its alarms, which name them; a registered plant has none."""
    if not isinstance(plant, DescribedPlant):
        return
    home = plant.files[0].parent
    for file in plant.files:
        copy = folder / file.relative_to(home)
        copy.parent.mkdir(parents=True, exist_ok=True)
        if not copy.exists() or not copy.samefile(file):
            shutil.copyfile(file, copy)
