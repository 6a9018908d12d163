"""Which long checks there are: every file with tests marked `slow` in one group, and commands with stated sizes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Step:
    """One process: a file of tests of which the slow ones run, or a module that ends on "N cases, N failures"."""

    group: str
    arguments: tuple[str, ...]
    is_pytest: bool

    def __str__(self) -> str:
        return " ".join(self.arguments)


FOLDERS = {
    "core": ("tests/core", "tests/oracle"),
    "polytopes": ("tests/polytopes",),
    "observers": ("tests/svo/observers", "tests/svo/isolation"),
    "plants": ("tests/aircraft", "tests/benchmarks"),
    "statistics": ("tests/svo/residual_tests", "tests/svo/interval", "tests/svo/baselines"),
    "svo": ("tests/svo", "tests/testing"),
}
"""Groups of tests by folder; a file belongs to the first that holds it."""

COMMANDS = {
    "soundness": (
        ("benchmarks.soundness", "--observer", "window", "--samples", "100000"),
        ("benchmarks.soundness", "--observer", "zonotope", "--samples", "30000"),
        ("benchmarks.soundness", "--observer", "polytope", "--samples", "10000"),
    ),
    "nonlinear": (
        ("benchmarks.nonlinear", "--samples", "48000"),
        ("benchmarks.enclosed_points", "--count", "80"),
        ("benchmarks.tape_operations", "--points", "10000"),
        ("benchmarks.eclipse_banks", "--runs", "3", "--manoeuvres", "2"),
    ),
    "mutation": (("tests.mutation",),),
    "core": (("tests.core.fuzz", "--cases", "5000"),),
    "fuzz": (("tests.fuzz", "--cases", "3000"),),
}


def group_of(file: str) -> str | None:
    """The group of a test file, given relative to the root."""
    return next((name for name, folders in FOLDERS.items() for f in folders if file.startswith(f"{f}/")), None)


def slow_files() -> list[str]:
    """Test files that mark a test as slow."""
    files = (path for path in sorted((ROOT / "tests").rglob("test_*.py")) if "mark.slow" in path.read_text("utf-8"))
    return [path.relative_to(ROOT).as_posix() for path in files]


def steps() -> Iterator[Step]:
    """All steps, group by group."""
    files = slow_files()
    for name in FOLDERS:
        for file in files:
            if group_of(file) == name:
                yield Step(name, (file,), is_pytest=True)
    for name, commands in COMMANDS.items():
        for command in commands:
            yield Step(name, command, is_pytest=False)
