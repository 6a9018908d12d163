"""What never changes: its copy is the object itself, and what comes back from a pickle is as read-only as it was."""

from collections.abc import Mapping
from typing import Any, Self

import numpy as np


class Value:
    """Base of immutable objects whose arrays are read-only."""

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        for name, value in state.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, name, value)
