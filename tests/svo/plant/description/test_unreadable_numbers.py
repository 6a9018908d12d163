"""Numbers and brackets of a TOML file that are too large, too long or too deep: one error with file and key, soon."""

from __future__ import annotations

from pathlib import Path
from time import process_time

import numpy as np
import pytest

from svo.plant.description import read_description

CART = (Path(__file__).parents[4] / "docs" / "examples" / "cart.toml").read_text(encoding="utf-8")
NOISE, LONG = "n = [0.05]", "9" * 5000
WRONG = {
    "5000 digits": (NOISE, f"n = [{LONG}]", r"line \d+, key 'n': a number has 5000 digits"),
    "5000 digits in a table": ("magnitude = 0.5", f"magnitude = {LONG}", "key 'magnitude': a number has 5000 digits"),
    "400 digits": (NOISE, f"n = [{'9' * 400}]", r"\[model\], key 'n': n contains an integer of 1329 bits"),
    "one number of 400 digits": ("Ts = 0.1", f"Ts = {'9' * 400}", "key 'Ts': Ts contains an integer of 1329 bits"),
    "5000 hexadecimal digits": (NOISE, f"n = [0x{'f' * 5000}]", "key 'n': n contains an integer of 20000 bits"),
    "hexadecimal digits for text": ('kind = "bias"', f"kind = 0x{'f' * 5000}", "key 'kind': is a int that is too long"),
    "no float": (NOISE, "n = [9007199254740993]", "key 'n': n contains 9007199254740993, which no float equals"),
    "deep brackets": (NOISE, f"n = {'[' * 5000}{']' * 5000}", r"line \d+, key 'n': brackets are nested too deeply"),
    "100 brackets": (NOISE, f"n = {'[' * 100}1{']' * 100}", "key 'n': is .*expected numbers in brackets"),
    "deep tables": (NOISE, f"n = {'{a=' * 5000}1{'}' * 5000}", "key 'n': brackets are nested too deeply"),
    "a key of many parts": (NOISE, f"{NOISE}\n{'.'.join('a' * 20000)} = 1", "a key has more than 50 parts"),
    "a long key": (NOISE, f'{NOISE}\n"{"x" * 5000}" = 1', "key 'xxx.*there is no such key"),
    "a horizon beyond memory": ("horizon = 10", "horizon = 1000000000", "horizon makes a window of .* GB; expected"),
    "a horizon beyond floats": ("horizon = 10", f"horizon = {'9' * 400}", "horizon is beyond all memory; expected"),
    "NaN": (NOISE, "n = [nan]", r"key 'n': n contains NaN at \[0\]"),
    "a truth value": (NOISE, "n = [true]", "key 'n': is .*expected numbers"),
    "rows of two lengths": ("C = [[1.0, 0.0]]", "C = [[1.0, 0.0], [1.0]]", "key 'C': is .*rows of one length"),
}


@pytest.mark.parametrize("name", WRONG)
def test_it_is_one_error_with_file_and_key(tmp_path: Path, name: str) -> None:
    old, new, message = WRONG[name]
    assert old in CART
    (tmp_path / "cart.toml").write_text(CART.replace(old, new, 1), encoding="utf-8")
    begun = process_time()
    with pytest.raises(ValueError, match=message) as caught:
        read_description(tmp_path / "cart.toml")
    assert "cart.toml" in str(caught.value)
    assert len(str(caught.value)) < 1000
    assert process_time() - begun < 10.0


def test_the_mark_that_some_editors_begin_a_file_with_is_no_mistake(tmp_path: Path) -> None:
    (tmp_path / "cart.toml").write_bytes(b"\xef\xbb\xbf" + CART.encode())
    assert np.array_equal(read_description(tmp_path / "cart.toml").model.bounds()[2], [0.05])
