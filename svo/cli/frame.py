"""What every command shares: the application, errors in one line, notes on standard error."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from svo.terminal import ReaderGoneError, line, safe_output

if TYPE_CHECKING:
    from svo.plant import MonitoredPlant, Plant


class _SafeGroup(TyperGroup):
    """Commands whose output, usage errors included, goes through `svo.terminal`; their list is not cut."""

    def main(self, *arguments: Any, **options: Any) -> Any:
        with safe_output():
            return super().main(*arguments, **options)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        said = ((name, self.get_command(ctx, name)) for name in self.list_commands(ctx))
        rows = [(name, (command.help or "").split("\n\n")[0].strip()) for name, command in said if command is not None]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


def _tell_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"svo {version('svo-fdi')}")
        raise typer.Exit


app = typer.Typer(
    cls=_SafeGroup,
    context_settings={"help_option_names": ["-h", "--help"]},
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


@app.callback()
def _svo(
    version: Annotated[
        bool, typer.Option("--version", callback=_tell_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Set-membership fault detection and isolation: studies, simulation, detection on logs, proofs of alarms.

    What exists is never overwritten, by no command, unless --overwrite is given. Progress is shown on a terminal, on
    standard error; NO_COLOR=1 leaves out colours. The exit code is 0 only on success.
    """


_SHOWN = 10  # failures
KEPT = "interrupted; what is done is kept, and the same command with --resume goes on"


@contextmanager
def one_line_errors(interrupted: str = "interrupted") -> Iterator[None]:
    """What a user can cause becomes one line on standard error and exit code 1, and notes on logs a line each.

    ``interrupted`` is what to say after Ctrl-C.
    """
    try:
        with _notes_in_lines():
            yield
    except (ReaderGoneError, typer.Exit):
        raise  # a quiet end: whoever read the output has had enough, or all is said
    except OSError as error:
        fail(f"{error.filename}: {error.strerror}" if error.filename and error.strerror else str(error))
    except (ValueError, TypeError, RuntimeError, ImportError, OverflowError) as error:
        fail(str(error))
    except MemoryError as error:
        fail(f"not enough memory ({error}); take a shorter horizon, or fewer samples or workers")
    except KeyboardInterrupt:
        fail(interrupted, code=130)


@contextmanager
def _notes_in_lines() -> Iterator[None]:
    from svo.logs.columns import LogNote

    with warnings.catch_warnings():
        others = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *where: Any) -> None:
            if issubclass(category, LogNote):
                note(str(message))
            else:
                others(message, category, *where)

        warnings.simplefilter("always", LogNote)
        warnings.showwarning = show  # type: ignore[assignment]
        yield


def note(text: str) -> None:
    """One line on standard error, beside the results."""
    typer.echo(f"note: {line(text)}", err=True)


def tell_failures(lines: Sequence[str], what: str) -> None:
    """Name what failed in a study that went on, and end with exit code 1; nothing if nothing did."""
    if not lines:
        return
    for text in lines[:_SHOWN]:
        typer.echo(f"error: {line(text)}", err=True)
    more = f" ({len(lines) - _SHOWN} more of them are not shown)" if len(lines) > _SHOWN else ""
    fail(
        f"{len(lines)} {what} failed{more}; all others are done and in the results. The same command with --resume "
        "--retry-failed tries them again"
    )


def fail(message: str, code: int = 1) -> None:
    typer.echo(f"error: {line(' '.join(message.split()))}", err=True)
    raise typer.Exit(code)


def plant_to_simulate(name: str) -> Plant:
    """The registered plant of that name, or that of a TOML file with a table [simulation]."""
    from svo.plant.description.find import plant_to_simulate as found

    return found(name)


def chosen_noise(plant: MonitoredPlant, noise: str | None) -> str:
    """The noise set that was named, or the plant's first."""
    from svo.plant import chosen_noise as chosen

    return chosen(plant, noise)
