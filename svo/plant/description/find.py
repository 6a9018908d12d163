"""A plant by what a user types: the name of a registered one, or the path of a TOML file."""

from __future__ import annotations

import shutil
from functools import partial
from pathlib import Path
from typing import Any

from polytopes.signatures import options_by_name
from svo.checks import expect_kind
from svo.plant import BankChoice, MonitoredPlant, Plant, load_plant, registered_plants, with_bank
from svo.plant.description.plant import DescribedPlant, read_description
from svo.plant.description.simulated import SimulatedPlant, simulated_plant
from svo.store import digest_of, write_whole

SUFFIX = ".toml"


@options_by_name
def find_plant(
    name: str | Path, folder: str | Path = "", *, architecture: str | None = None, models: str | None = None
) -> MonitoredPlant:
    """A plant by the path of the TOML file that describes it, or by the name under which it is registered.

    Parameters
    ----------
    name : str or path
        One that ends in .toml is a file.
    folder : path
        What the path is relative to; the present folder by default.
    architecture : str, optional
        Of the bank, such as "I" or "II", where the plant offers a choice; by default the plant's own.
    models : str, optional
        Kind of the observers' models, such as "lpv" or "nonlinear", likewise.

    Raises
    ------
    TypeError
        If the name is no text and no path.
    ValueError
        If no plant is registered by that name, the description has a mistake, or there is no such architecture or kind
        of models.
    OSError
        If the file cannot be opened.
    """
    expect_kind("name", name, (str, Path), "the name of a registered plant, or the path of a TOML file")
    return with_bank(_found(str(name), Path(folder)), BankChoice(architecture, models))


def _found(name: str, folder: Path) -> MonitoredPlant:
    if name.endswith(SUFFIX):
        return read_description(folder / name)
    if (folder / name).is_file() and name not in registered_plants():
        raise ValueError(f"{name} is a file, and no plant is registered by that name; a description ends in {SUFFIX}")
    return load_plant(name)


def plant_to_simulate(name: str) -> Plant:
    """A registered plant by its name, or one with a table [simulation] by the path of its TOML file.

    Raises
    ------
    ValueError, OSError
        As `find_plant`, and for a file that describes no simulation.
    """
    found: Any = simulated_plant(name) if name.endswith(SUFFIX) else load_plant(name)
    plant: Plant = found
    return plant


def described(plant: Any) -> DescribedPlant | None:
    """The description of a plant that has one, simulated or not."""
    own = plant.described if isinstance(plant, SimulatedPlant) else plant
    return own if isinstance(own, DescribedPlant) else None


def check_kept_description(plant: MonitoredPlant, folder: Path) -> None:
    """Raise a ValueError if another description stands where `keep_description` would put that of a plant."""
    for file, copy in _copies(plant, folder):
        if copy.exists() and copy.read_bytes() != file.read_bytes():
            raise ValueError(
                f"{copy} is another file than {file}, and alarms beside it may be about it; "
                "give another folder, or move it away first"
            )


def keep_description(plant: MonitoredPlant, folder: Path, overwrite: bool = False) -> None:
    """Copy the files that describe a plant beside its alarms, which name them; a registered plant has none.

    Raises
    ------
    ValueError
        If another file stands there, unless it is to be overwritten.
    """
    if not overwrite:
        check_kept_description(plant, folder)
    for file, copy in _copies(plant, folder):
        copy.parent.mkdir(parents=True, exist_ok=True)
        if overwrite or not copy.exists():
            write_whole(copy, partial(shutil.copyfile, file))


def description_digest(plant: MonitoredPlant) -> dict[str, str]:
    """SHA-256 of each file that describes a plant, by name; a registered plant has none."""
    own = described(plant)
    return {} if own is None else {file.name: digest_of(file) for file in own.files}


def _copies(plant: MonitoredPlant, folder: Path) -> list[tuple[Path, Path]]:
    """The files of a description and where they are kept."""
    own = described(plant)
    if own is None:
        return []
    home = own.files[0].parent
    return [(file, folder / file.relative_to(home)) for file in own.files]
