"""Examples that CORA prints the results of: what the page says of ours."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks._cora_examples import Box, laub_loomis, observed_tanks, tanks_one_step
from benchmarks.published_nonlinear import common, estimated


def width(box: Box) -> np.ndarray:
    return box[1] - box[0]


def test_an_estimation_from_the_same_readings_is_narrower_in_every_state() -> None:
    example = observed_tanks()
    box, _ = estimated(example, 10)
    for printed in example.printed.values():
        assert common(box, printed)
        assert (width(box) < width(printed)).all()
        assert (width(box)[[0, 1, 2, 3, 4]] < 0.45 * width(printed)[[0, 1, 2, 3, 4]]).all()


@pytest.mark.parametrize("make", [tanks_one_step, laub_loomis])
def test_a_prediction_is_narrower_than_what_is_printed_of_it(make) -> None:
    example = make()
    box, _ = estimated(example, 5)
    for printed in example.printed.values():
        assert common(box, printed)
        assert (width(box) < width(printed)).all()
