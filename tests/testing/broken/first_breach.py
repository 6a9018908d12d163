"""Which rules a subject breaks, in the order in which they are asked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from svo.testing import ConformanceError, Rule
from svo.testing.rules import NotApplicable


def broken_rules(rules: Mapping[str, Rule], subject: Any) -> list[str]:
    broken = []
    for name, rule in rules.items():
        try:
            rule.check(subject)
        except ConformanceError:
            broken.append(name)
        except NotApplicable:
            continue
    return broken
