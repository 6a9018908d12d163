"""What every command shares: the application, errors in one line, notes on standard error."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from svo.plant import MonitoredPlant, Plant

app = typer.Typer(
    help="Set-membership fault detection and isolation: studies, simulation, detection on logs, proofs of alarms.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

PREPARING = "Preparing compiled code (about a minute the first time, then kept)"


@contextmanager
def one_line_errors() -> Iterator[None]:
    """What a user can cause becomes one line on standard error and exit code 1."""
    try:
        yield
    except OSError as error:
        fail(f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error))
    except (ValueError, TypeError, RuntimeError, ImportError) as error:
        fail(str(error))
    except KeyboardInterrupt:
        fail("interrupted; the runs of a study that are done are kept, and --resume goes on", code=130)


def fail(message: str, code: int = 1) -> None:
    typer.echo(f"error: {' '.join(message.split())}", err=True)
    raise typer.Exit(code)


def plant_to_simulate(name: str) -> Plant:
    """The registered plant of that name, for the commands that a description alone is not enough for."""
    from svo.description.find import SUFFIX
    from svo.plant import load_plant, registered_plants

    if name.endswith(SUFFIX):
        raise ValueError(
            f"{name}: a TOML file describes a model for logs, and this command needs a plant that it can simulate; "
            f"expected a registered one: {', '.join(registered_plants()) or 'none is installed'}. Use the file with "
            "svo detect, svo watch or svo calibrate, or register a plant in Python (docs/studies.md, 'A plant of your "
            "own')"
        )
    return load_plant(name)


def chosen_noise(plant: MonitoredPlant, noise: str | None) -> str:
    """The noise set that was named, or the plant's first."""
    from svo.study.configuration import check_noise

    chosen = plant.noise_sets[0] if noise is None else noise
    check_noise(plant, chosen)
    return chosen


def announce(what: str) -> None:
    typer.echo(f"{what} ...", err=True)
