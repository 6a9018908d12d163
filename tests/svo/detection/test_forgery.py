"""Edits of alarms and proofs, judged by trajectories in fractions; more of them: ``python -m benchmarks.forgery``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from proof_cases import proven, steps_of, tiny

from benchmarks._claims import of_plant, of_window, one_reading, set_of
from benchmarks._exact_witness import Instant, Start, witness
from benchmarks._forged_proofs import Checked
from benchmarks.forgery import judged, run
from polytopes import HPolytope
from svo import UncertainModel, WindowObserver
from svo.detection.plant_record import plant_record
from svo.isolation.alarms import read_alarms, verify_alarms
from tests.svo.detection.checkers import CHECK

DATA = Path(__file__).parents[1] / "isolation" / "data"


@pytest.mark.parametrize(("target", "edits"), [("plain", 60), ("log", 60), ("full", 40), ("checker", 40)])
def test_no_edit_proves_what_is_false(target: str, edits: int) -> None:
    counts, holes, _ = run(target, edits, None)
    assert holes == []
    assert counts["refused"] > 0.5 * edits
    assert counts["still true"] > 0


def test_edits_that_are_done_are_not_done_again(tmp_path: Path) -> None:
    out = tmp_path / "plain.jsonl"
    first = run("plain", 30, out)
    assert out.read_text().count("\n") == 1
    assert run("plain", 30, out) == first


# -- the oracle knows what is false ------------------------------------------------------------------------------------


def test_healthy_samples_are_explained_exactly() -> None:
    plant, log, healthy = tiny()
    record = plant_record(plant, "stated")["observers"]["nominal"]
    explained = [
        witness(*(lambda found: (found[0], set_of(record["first"]), found[1]))(of_plant(record, log, 0, k)))
        for k in range(len(log))
    ]
    assert explained == [True] * (healthy + 1) + [False] * (len(log) - healthy - 1)


@pytest.mark.parametrize("seed", range(6))
def test_a_record_with_what_was_simulated_is_explained_and_its_alarm_is_not(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = UncertainModel([[0.9, 0.2], [0.0, 0.7]], [[0.0], [1.0]], [[1.0, 0.0]], E=[[0.1], [0.3]], w=[0.2], n=[0.1])
    log = model.simulate([0.0, 0.0], rng.normal(size=(20, 1)), rng)
    log.y[12:] += 3.0
    step = WindowObserver(model, HPolytope.box([-0.1, -0.1], [0.1, 0.1]), horizon=5).run(log).certificate
    assert step is not None
    claim = of_window(step)  # type: ignore[arg-type]
    assert not witness(*claim)
    eased = [Instant(s.stack, s.u, s.y, s.width + 4.0, s.w_lower, s.w_upper) for s in claim[0]]
    assert witness(eased, *claim[1:])


def test_bounds_are_kept_to_the_last_bit() -> None:
    one = np.array([[[1.0, 0.0], [1.0, 0.0]]])
    start = Start((np.array([0.5]), np.array([0.5])), np.zeros((0, 1)), np.zeros(0), np.zeros(0))
    nothing = np.zeros(0)
    for y, holds in ((0.75, True), (np.nextafter(0.75, 1.0), False)):
        instant = Instant(one, nothing, np.array([y]), np.array([0.25]), nothing, nothing)
        assert witness([instant], start, np.zeros((0, 2))) is holds


def test_a_checker_that_takes_any_multipliers_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    """The whole of forging and judging, with a fault in what is judged: alarms at healthy samples are false."""
    judge = Checked(only_one=True)
    monkeypatch.setattr(judge._check.Chain, "_total", lambda *_, **_named: judge._check.num(1e300))
    holes = judged(judge, range(60), 1)["holes"]
    assert any("explains samples up to" in what for _, _, what in holes)


# -- one reading -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda line: line.replace('"sample": ', '"sample": 3, "sample": ', 1), "twice"),
        (lambda line: line.replace('"n": 2', '"n": 2, "n": 2', 1), "twice"),
        (lambda line: line.replace('"seed": ', '"seed": NaN, "other": ', 1) if "seed" in line else "NaN", "JSON"),
        (lambda line: line.replace('"source": {', '"source": {"\u00e9": 1, ', 1), "ASCII"),
        (lambda line: "\ufeff" + line, "JSON"),
    ],
)
def test_a_record_that_two_programs_read_differently_is_refused(tmp_path: Path, change, why: str) -> None:
    line = (DATA / "svo_alarm_2.jsonl").read_text()
    path = tmp_path / "alarms.jsonl"
    path.write_text(line + change(line), encoding="utf-8")
    good, bad = verify_alarms(path)
    assert good.ok
    assert not bad.ok
    assert why in bad.reason
    with pytest.raises(ValueError, match="line 2"):
        read_alarms(path)


def refused(*files: Path) -> str:
    """What the checker's own reading says of a plant and a log."""
    try:
        plant = CHECK.parsed(files[1].read_bytes())
        CHECK.check(files[0], plant, CHECK.Log(files[2], plant["columns"]))
    except CHECK.REFUSALS as error:
        return str(error)
    return ""


def test_the_checker_refuses_files_of_two_readings(tmp_path: Path) -> None:
    plant, log, _ = tiny()
    files = proven(plant, log, tmp_path)
    assert files is not None
    assert refused(*files) == ""
    steps, model, text = steps_of(files[0]), files[1].read_text(), files[2].read_text()
    twice = [json.dumps(step) for step in steps]
    twice[1] = twice[1].replace('"sample": ', '"sample": 1, "sample": ', 1)
    (tmp_path / "twice").write_text("\n".join(twice) + "\n")
    assert "twice" in refused(tmp_path / "twice", *files[1:])
    for changed in (
        "\ufeff" + model,
        model.replace('"Ts"', '"Ts": "0", "Ts"'),
        model.replace('"samples": 12', '"samples": NaN'),
    ):
        (tmp_path / "changed").write_text(changed, encoding="utf-8")
        assert refused(files[0], tmp_path / "changed", files[2]), changed[:40]
    header, *rows = text.splitlines()
    cells = rows[3].split(",")
    for cell in ("1_0", "\uff11", "inf", "0x1p3", "1.0\x0c", "1\u2028", "1e", "--1", '"1'):
        row = ",".join([*cells[:-1], cell])
        (tmp_path / "log").write_text("\n".join([header, *rows[:3], row, *rows[4:]]) + "\n", encoding="utf-8")
        assert refused(*files[:2], tmp_path / "log"), cell
    for other in (",".join([*cells, "1"]), ",".join(cells[:-1]), "# a remark"):
        (tmp_path / "log").write_text("\n".join([header, *rows[:3], other, *rows[4:]]) + "\n")
        assert refused(*files[:2], tmp_path / "log"), other
    with_column = [header + ",y0", *(row + ",0.0" for row in rows)]
    (tmp_path / "log").write_text("\n".join(with_column) + "\n")
    assert "one column" in refused(*files[:2], tmp_path / "log")


def test_one_reading_is_told_from_two() -> None:
    assert one_reading(b'{"a": 1}\n{"a": 2}\n')
    for text in (b'{"a": 1, "a": 1}', b'{"a": NaN}', '{"a": "\u00e9"}'.encode(), b"\xff"):
        assert not one_reading(text)
