"""What an observer can do besides: declared on its class, each by a flag and the hooks that it then defines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from numpy.typing import NDArray

from svo.checks import Array
from svo.models import UncertainModel
from svo.observers.answers import Step
from svo.observers.saved_state import State


class Capabilities:
    """What a kind of observer can do; by default nothing besides its steps.

    Attributes
    ----------
    kind : str
        Name of the kind, in `options` and messages.
    takes_deadline : bool
        Whether `step` can stop at a deadline.
    takes_late : bool
        Whether `late_update` takes measurements that come late: `_oldest`, `_read_at` and `_late_update` are defined.
    saves_state : bool
        Whether it can be saved and go on: `_options`, `_state`, `_set_up` and `_resume` are defined.
    starts_without_set : bool
        Whether it can start with nothing known of the state: `_lose_set` is defined.
    takes_intervals : bool
        Whether a transition may take another time than the sampling time: `_set_interval` is defined.
    takes_jitter : bool
        Whether its model may have sensors whose time stamps are off.
    takes_nonlinear : bool
        Whether its model may be a `NonlinearModel`.
    """

    kind: ClassVar[str] = "own"
    takes_deadline: ClassVar[bool] = False
    takes_late: ClassVar[bool] = False
    saves_state: ClassVar[bool] = False
    starts_without_set: ClassVar[bool] = False
    takes_intervals: ClassVar[bool] = False
    takes_jitter: ClassVar[bool] = False
    takes_nonlinear: ClassVar[bool] = False

    @property
    def _oldest(self) -> int:
        """First sample of `window`."""
        raise NotImplementedError

    def _read_at(self, sample: int) -> Array:
        """What was read at a sample of the window; NaN where a sensor is missing."""
        raise NotImplementedError

    def _late_update(self, y: Array, sample: int) -> Step:
        """A late measurement of a sample of the window; the answer is about the newest sample."""
        raise NotImplementedError

    def _check_interval(self, dt: float) -> None:
        """Refuse seconds that a transition cannot take, before anything is taken."""

    def _set_interval(self, dt: float | None) -> None:
        """The next transition takes ``dt`` seconds; None: the model's ``Ts``."""
        raise NotImplementedError

    def _lose_set(self) -> None:
        """Start with nothing known but the model's ranges."""
        raise NotImplementedError

    def _options(self) -> Mapping[str, Any]:
        """The options besides the kind."""
        return {}

    def _state(self) -> dict[str, NDArray[Any]]:
        """The arrays of a saved state."""
        raise NotImplementedError

    def _set_up(self, model: UncertainModel, state: State) -> None:
        """Take model and options from a state, as the constructor does from its arguments."""
        raise NotImplementedError

    def _resume(self, state: State) -> Step | None:
        """Take the rest, `_number` too; the answer of a falsification, proven again, if there was one."""
        raise NotImplementedError

    def _check_can(self, able: bool, why_not: str) -> None:
        if not able:
            raise TypeError(f"{type(self).__name__} {why_not}")
