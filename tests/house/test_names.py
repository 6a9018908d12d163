"""`docs/naming.md` is the contract of names: what its table says of an argument holds in every public signature."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from typing import Any

from tests.house.imports import ROOT

FACES = (
    "polytopes", "svo", "svo.plant", "svo.faults", "svo.indices", "svo.interval", "svo.residual_tests", "svo.baselines",
)  # fmt: skip
TYPES = {
    "noise": r"str|NoiseCharacterization|Sequence\[str\]",
    "n": r"int|float|Schedulable",
    "w": r"ArrayLike|Any|Schedulable",
    "Ts": r"float( \| None)?",
    "horizon": r"int( \| None)?",
    "set": r"(polytopes\.hpolytope\.)?HPolytope",
    "late": r"Iterable\[LateMeasurement\]",
    "deadline": r"float( \| None)?",
    "rng": r"np\.random\.Generator|numpy\.random\._generator\.Generator",
    "fault": r"str",
    "profile": r"str|Profile",
}
"""The annotation that an argument of a public function has; results keep other words of the field."""


def public_arguments() -> Iterator[tuple[str, str, str]]:
    """Every argument of a public function or method: where, name, annotation."""
    for face in FACES:
        for name in import_module(face).__all__:
            for label, function in functions_of(name, getattr(import_module(face), name)):
                for parameter in inspect.signature(function).parameters.values():
                    kind = getattr(parameter.annotation, "__qualname__", None) or str(parameter.annotation)
                    yield f"{face}.{label}", parameter.name, kind


def functions_of(name: str, thing: Any) -> Iterator[tuple[str, Any]]:
    if inspect.isfunction(thing):
        yield name, thing
    elif inspect.isclass(thing) and not hasattr(thing, "__dataclass_fields__"):
        members = inspect.getmembers(thing, inspect.isfunction)
        yield from ((f"{name}.{key}", f) for key, f in members if key == "__init__" or not key.startswith("_"))


def test_an_argument_means_one_thing() -> None:
    held = [argument for argument in public_arguments() if argument[1] in TYPES]
    assert len(held) > 30
    assert not [(where, name, a) for where, name, a in held if not re.fullmatch(f"({TYPES[name]})", a.strip("'"))]


def test_the_table_of_the_contract_has_them() -> None:
    page = (ROOT / "docs" / "naming.md").read_text("utf-8")
    assert not {name for name in TYPES if f"`{name}`" not in page}
