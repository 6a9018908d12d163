"""What the command line prints. Whatever is slow to import is imported where it is needed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import typer

from svo.terminal import json_text, line

if TYPE_CHECKING:
    from rich.console import Console

    from svo.analysis.isolability import Isolability
    from svo.detection.verification import Verification
    from svo.plant import Plant
    from svo.studies.isolation.summary import ConditionSummary
    from svo.studies.thresholds.results import DetectionStudy


def describe(plant: Plant) -> dict[str, Any]:
    """A plant as plain data, for JSON."""
    columns = plant.columns
    return {
        "name": plant.name,
        "title": plant.title,
        "Ts": plant.Ts,
        "fault_time": plant.fault_time,
        "faults": {fault: list(profiles) for fault, profiles in plant.faults.items()},
        "noise_sets": list(plant.noise_sets),
        "columns": {
            "time": columns.time,
            **{
                group: [{"name": c.name, "unit": c.unit} for c in getattr(columns, group)]
                for group in ("inputs", "outputs", "states")
            },
        },
    }


def console() -> Console:
    """Where tables go."""
    from svo.terminal import console as safe_console

    terminal = safe_console(highlight=False)
    # A file has no width: a table in it need not be cut off.
    return terminal if terminal.is_terminal else safe_console(highlight=False, width=150)


def say(text: str, err: bool = False) -> None:
    """One line, whatever names are in it."""
    typer.echo(line(text), err=err)


def print_json(value: Any) -> None:
    """Figures as JSON on standard output."""
    typer.echo(json_text(value, indent=2))


def print_study(plant: Plant, summaries: Sequence[ConditionSummary]) -> None:
    """Tables of a study, one a noise set, and what they count."""
    from svo.pages.tables import to_rich
    from svo.studies.isolation import tables

    screen = console()
    for noise in dict.fromkeys(s.noise for s in summaries):
        chosen = [s for s in summaries if s.noise == noise]
        screen.print(to_rich(tables.delay_table(plant, chosen)))
        for text in [*tables.counts(chosen), *tables.not_isolated(chosen), tables.cost(chosen)]:
            say(f"{text[0].upper()}{text[1:]}.")
        typer.echo("")
    if plant.reference:
        say(f"Paper: {plant.reference_title}; a dash where it says nothing.")


def print_detector_study(found: DetectionStudy) -> None:
    """Tables of a study of interval detectors, and what came out."""
    from svo.pages.tables import to_rich

    screen = console()
    for table in found.tables:
        screen.print(to_rich(table))
    for text in found.findings:
        say(f"{text[0].upper()}{text[1:]}.")


def print_isolability(answer: Isolability) -> None:
    """Samples until each observer is surely falsified, fault by fault."""
    from rich.table import Table

    table = Table(title=f"Samples until an observer is surely falsified ({answer.noise} noise)")
    table.add_column("plant with fault")
    observers = list(next(iter(answer.answers.values())))
    for name in observers:
        table.add_column(f"observer {name}")
    for fault, description in answer.faults.items():
        table.add_row(f"{fault}: {description}", *(answer.cell(fault, name) for name in observers))
    console().print(table)
    say(
        f"Inputs and schedule: the fault-free flight of seed {answer.seed}, from {answer.fault_time:g} s on. "
        "The first faulty sample counts as 1; an observer with a short window may need more."
    )


def print_checks(found: Verification) -> None:
    """Alarms that failed, one a line on standard error, and how many were proven."""
    for text in found.failures:
        say(text, err=True)
    say(found.summary)
