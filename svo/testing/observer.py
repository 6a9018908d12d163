"""The rules that an observer keeps, and the check that asks them."""

from __future__ import annotations

from svo.testing import observer_calls as calls
from svo.testing import observer_sets as sets
from svo.testing.observer_kind import Kind, Make
from svo.testing.rules import Conformance, keep, table

OBSERVER_RULES = table(
    calls.runs_apart,
    calls.answers,
    calls.arrays_of_the_caller,
    sets.box,
    sets.input_of_its_sample,
    sets.missing_readings,
    calls.alarm_with_proof,
    calls.falsified_is_final,
    calls.reset_after_falsification,
    calls.undecided_is_an_answer,
    calls.deadline,
    sets.late_at_its_sample,
    calls.saved_state,
    calls.wrong_data,
    sets.every_possible_state,
    sets.healthy_plant,
    calls.a_log_is_its_samples,
)


def check_observer(make: Make) -> Conformance:
    """Ask every rule of `OBSERVER_RULES` of a kind of observer.

    Parameters
    ----------
    make : callable
        Called as ``make(model, initial)`` with an `UncertainModel` and a bounded `HPolytope`, returns a fresh observer:
        its class, or a function that sets further arguments. A model that the kind cannot do is refused with
        NotImplementedError or ValueError; the plainest (one state, all matrices constant) it must take.

    Returns
    -------
    Conformance
        The rules that hold, and with their reasons those that could not be asked and the models that were refused.

    Raises
    ------
    TypeError
        If ``make`` cannot be called.
    ConformanceError
        (an AssertionError) at the first broken rule; it names the rule, what was seen and what to do.

    Notes
    -----
    Seeds are fixed and it takes seconds. The sets of small models are compared with every state that is possible, in
    fractions: readings and bounds are short binary numbers and every unknown is at an end of its interval, so a bound
    that is rounded inward by the last bit is seen. Sets may be wider than need be; how wide is no rule.
    """
    if not callable(make):
        raise TypeError(
            f"make is {type(make).__name__}; expected a class of observers, or a function of (model, initial)"
        )
    kind = Kind(make)
    found = keep(OBSERVER_RULES.values(), kind)
    refused = {f"models with {name}": reason for name, reason in kind.refused.items()}
    return Conformance(found.kept, {**found.left_out, **refused})
