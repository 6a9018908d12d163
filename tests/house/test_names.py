"""`docs/naming.md` is the contract of names: what its table says of an argument holds in every public signature."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator

from tests.house.imports import ROOT
from tests.house.public import callables

TYPES = {
    "noise": r"str( \| None)?|NoiseCharacterization|Sequence\[str\]",
    "n": r"int|float|Schedulable",
    "w": r"ArrayLike|Any|Schedulable",
    "Ts": r"float( \| None)?",
    "horizon": r"int( \| None)?",
    "set": r"(polytopes\.hpolytope\.)?HPolytope",
    "late": r"Iterable\[LateMeasurement\]",
    "deadline": r"float( \| None)?",
    "rng": r"(np\.random\.)?Generator",
    "fault": r"str",
    "profile": r"str|Profile",
}
"""The annotation that an argument of a public function has; results keep other words of the field."""


def public_arguments() -> Iterator[tuple[str, str, str]]:
    """Every argument of a public function or method: where, name, annotation."""
    for where, (item, _) in callables().items():
        for parameter in inspect.signature(item).parameters.values():
            if not hasattr(item, "__dataclass_fields__"):
                kind = getattr(parameter.annotation, "__qualname__", None) or str(parameter.annotation)
                yield where, parameter.name, kind


def test_an_argument_means_one_thing() -> None:
    held = [argument for argument in public_arguments() if argument[1] in TYPES]
    assert len(held) > 30
    assert not [(where, name, a) for where, name, a in held if not re.fullmatch(f"({TYPES[name]})", a.strip("'"))]


def test_the_table_of_the_contract_has_them() -> None:
    page = (ROOT / "docs" / "naming.md").read_text("utf-8")
    assert not {name for name in TYPES if f"`{name}`" not in page}
