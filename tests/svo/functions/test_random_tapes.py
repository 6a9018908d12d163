"""Random tapes of many operations: forms and ranges contain what balls give, and are those of Python's own rules."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from svo import functions as F
from svo.functions.expression import Recorder, variables
from svo.functions.tape import Tape, Unenclosed
from tests.svo.functions.oracle.evaluation import Evaluation
from tests.svo.functions.oracle.evaluation import Unenclosed as UnenclosedThere
from tests.svo.functions.random_tapes import draw_tape, examine

SEED = 20_261_129


def test_random_tapes_contain_what_balls_give() -> None:
    count = examine(np.random.default_rng(SEED), 400)
    assert count["points"] > 2000
    assert count["refused"] < 300
    assert not {what: n for what, n in count.items() if what.startswith("outside") and n}


def test_the_core_keeps_the_rules_that_python_has() -> None:
    """The same refusals, and forms that are no wider than by rounding."""
    rng, refused = np.random.default_rng(SEED), 0
    for _ in range(300):
        tape = draw_tape(rng)
        middle, width = rng.normal(size=tape.variables), rng.uniform(0.0, 0.5, tape.variables)
        lower, upper, free = middle - width, middle + width, tape.variables
        there, here = (_forms_or_why(ask, lower, upper, free) for ask in (Evaluation(tape), tape))
        if isinstance(there, tuple) and len(there) == 2:
            assert here == there
            refused += 1
            continue
        size = 1.0 + np.maximum(np.abs(there.lower), np.abs(there.upper)) + np.abs(there.k)
        assert ((here.high - here.low) <= 1.001 * (there.high - there.low) + 1e-12 * size).all()
        assert (np.abs(here.lower - there.lower) <= 1e-3 * (there.upper - there.lower) + 1e-12 * size).all()
        assert (np.abs(here.upper - there.upper) <= 1e-3 * (there.upper - there.lower) + 1e-12 * size).all()
    assert 10 < refused < 200


def _forms_or_why(ask: Any, *box: Any) -> Any:
    try:
        return ask.forms(*box)
    except (Unenclosed, UnenclosedThere) as error:
        return str(error), error.row


def _tape() -> Tape:
    recorder = Recorder()
    z = variables(recorder, 0, 3)
    rows = [F.sroot(z[0] - z[1]) * F.sqrt(z[2] + 1.0), F.max(z[0], z[1]) * z[2] + z[0] ** 2]
    return Tape.of(recorder, rows, 3)


def test_a_pickled_tape_answers_the_same() -> None:
    tape = _tape()
    lower, upper = np.array([0.1, 0.2, 0.3]), np.array([0.4, 0.5, 0.7])
    before = tape.forms(lower, upper, 2)
    again = pickle.loads(pickle.dumps(tape))
    for tapes in (again, tape):
        for mine, its in zip(tapes.forms(lower, upper, 2), before, strict=True):
            assert np.array_equal(mine, its)


def test_threads_share_a_tape() -> None:
    tape, rng = _tape(), np.random.default_rng(SEED)
    boxes = [(m := rng.normal(size=3) ** 2, m + rng.uniform(0.0, 0.3, 3)) for _ in range(200)]
    alone = [tape.forms(*box, 3) for box in boxes]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda box: tape.forms(*box, 3), boxes))
    assert all(np.array_equal(m.g, i.g) and np.array_equal(m.low, i.low) for m, i in zip(alone, together, strict=True))
