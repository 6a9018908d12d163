"""What users call: every argument is named by a docstring, and options are given by name."""

from __future__ import annotations

import re
from inspect import Parameter, ismethod, signature

import pytest

from tests.house.public import arguments, callables

PUBLIC = callables()
OPTIONS = {
    name: [p.name for p in signature(item).parameters.values() if p.kind is Parameter.KEYWORD_ONLY]
    for name, (item, _) in PUBLIC.items()
}


@pytest.mark.parametrize("name", PUBLIC)
def test_a_docstring_names_every_argument(name: str) -> None:
    item, said = PUBLIC[name]
    assert not [argument for argument in arguments(item) if not re.search(rf"\b{argument}\b", said)]


@pytest.mark.parametrize("name", [name for name, options in OPTIONS.items() if options])
def test_an_option_given_by_position_is_one_error_that_names_it(name: str) -> None:
    item, _ = PUBLIC[name]
    kinds = [p.kind for p in signature(item).parameters.values()]
    if Parameter.VAR_POSITIONAL in kinds:
        pytest.skip("takes any number by position")
    given = [None] * (1 + kinds.count(Parameter.POSITIONAL_OR_KEYWORD))
    with pytest.raises(TypeError) as caught:
        item(*given)
    assert not [option for option in OPTIONS[name] if f"{option}=" not in str(caught.value)]
    assert ismethod(item) or "self" not in str(caught.value)
