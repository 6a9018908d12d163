"""The report on a log: one page that says what was found, shows it whole, and says what each alarm proves."""

from __future__ import annotations

import hashlib
import re
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from svo import detect, find_plant, read_log
from svo.detection.found import Detection
from svo.detection.report.facts import bank_of, bounds_table, log_facts
from svo.detection.report.options import ReportOptions
from svo.detection.report.pictures import pictures_of
from svo.detection.report.report import write_report
from svo.logs.log import Log
from svo.plant import load_plant
from tests.svo.commands import one_line, svo

CART = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"
LOG = CART.with_suffix(".csv")
EVIL = "</script><img src=x onerror=alert(1)> {{ 7 * 7 }}"


def text_of(page: str) -> str:
    """What a reader sees, in one line."""
    page = re.sub(r"<(script|style|svg)\b.*?</\1>", " ", page, flags=re.DOTALL)
    return " ".join(re.sub(r"<[^>]*>", " ", page).replace("&#39;", "'").split())


def drawn_in(page: str) -> list[ElementTree.Element]:
    """The pictures, each a whole piece of XML."""
    return [ElementTree.fromstring(text) for text in re.findall(r'<svg role="img".*?</svg>', page, re.DOTALL)]


def cart(rows: slice = slice(None), **changed: Any) -> Detection:
    plant = find_plant(CART)
    log = read_log(LOG, plant)
    y = changed.get("y", log.y.copy())[rows]
    return detect(plant, Log(log.time[rows], log.u[rows], y, source="part.csv"))


def report_of(found: Detection, folder: Path, **options: Any) -> str:
    return write_report(folder, found, **options).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    out = tmp_path_factory.mktemp("report") / "out"
    return out, svo("detect", CART, LOG, "--out", out, "--report", "--format", "svg,PDF", "--format", "png")


def test_the_page_says_what_was_found_in_what_and_under_which_bounds(written: tuple[Path, Any]) -> None:
    out, result = written
    assert result.exit_code == 0, result.output
    assert f"Report: {out / 'report.html'}" in result.stdout
    text = text_of((out / "report.html").read_text(encoding="utf-8"))
    for line in result.stdout.splitlines()[:5]:
        assert line.strip().rstrip(".") in text
    for words in (
        "Detection report: A cart with a motor and a position sensor", "cart.csv", "80, one each 0.1 s",
        "0.0 s to 7.9 s", hashlib.sha256(LOG.read_bytes()).hexdigest(), "noise of position [m] ± 0.05 ± 0.55 ± 0.05",
        "uncertainty mass", "position [m]: bounds", "speed [m/s]: bounds", "svo-fdi 0.1.0", "--format svg,pdf,png",
        f"svo detect {CART} {LOG} --noise stated --out DIR --report",
    ):  # fmt: skip
        assert words in text


def test_each_alarm_says_what_it_proves_and_on_what_that_rests(written: tuple[Path, Any]) -> None:
    text = text_of((written[0] / "report.html").read_text(encoding="utf-8"))
    for alarm in cart().alarms:
        window = f"samples {alarm.sample + 1 - len(alarm.certificate.samples)} to {alarm.sample}"
        assert f"{alarm.observer}: falsified at 5.0 s No trajectory of the model '{alarm.observer}'" in text
        assert f"explains the readings of {window} (4.0 s to 5.0 s)." in text
        assert f"It rests on {alarm.certificate.premise(alarm.sample)}." in text
        assert str(alarm.model) in text
    assert text.count("exact rational arithmetic: it holds.") == 2
    assert "a fault is detected." in text
    assert "that fault is excluded." in text


def test_a_proof_that_does_not_hold_is_not_called_one(tmp_path: Path) -> None:
    found = cart()
    (alarm, *_) = found.alarms
    wrong = replace(alarm.certificate, **{"samples": (*alarm.certificate.samples[1:], alarm.certificate.samples[0])})
    page = report_of(replace(found, alarms=(replace(alarm, certificate=wrong),)), tmp_path)
    assert "THE PROOF DOES NOT HOLD" in page
    assert "it holds." not in page


def test_the_page_is_whole_and_loads_nothing(written: tuple[Path, Any]) -> None:
    page = (written[0] / "report.html").read_text(encoding="utf-8")
    assert "default-src 'none'; img-src data:; style-src 'sha256-" in page
    assert not re.search(r'(?:src|href)="(?:https?:)?//', page)
    assert ' style="' not in page  # which the policy forbids
    pictures = drawn_in(page)
    assert [picture.get("aria-label") for picture in pictures] == [
        "Verdicts of the bank", "position [m]: bounds", "speed [m/s]: bounds",
    ]  # fmt: skip
    names = re.findall(r'\bid="([^"]*)"', page)
    assert len(names) == len(set(names))
    assert set(re.findall(r'(?:href="#|url\(#)([^")]*)', page)) <= set(names)


def test_pictures_are_files_too_in_the_formats_that_are_asked_for(written: tuple[Path, Any]) -> None:
    begins = {".svg": b"<?xml", ".pdf": b"%PDF", ".png": b"\x89PNG"}
    files = sorted((written[0] / "pictures").iterdir())
    names = {"verdicts", "bounds_true_position", "bounds_true_speed"}
    assert {(file.stem, file.suffix) for file in files} == {(name, suffix) for name in names for suffix in begins}
    assert all(file.read_bytes().startswith(begins[file.suffix]) for file in files)


def test_a_choice_of_states_is_drawn(tmp_path: Path) -> None:
    assert svo("detect", CART, LOG, "--out", tmp_path / "out", "--report", "--states", "true_speed").exit_code == 0
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert [picture.get("aria-label") for picture in drawn_in(page)] == ["Verdicts of the bank", "speed [m/s]: bounds"]


def test_what_cannot_be_shown_is_said_before_anything_is_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("svo.isolation.Bank.run", lambda *_, **__: pytest.fail("work was begun"))
    report = ("detect", CART, LOG, "--out", tmp_path / "out", "--report")
    message = one_line(svo(*report, "--states", "true_speed,tilt"))
    assert "'tilt'" in message
    assert "true_position, true_speed, position" in message
    assert "expected any of svg, pdf, png" in one_line(svo(*report, "--format", "svg,gif"))
    assert "expected --out DIR" in one_line(svo("detect", CART, LOG, "--report"))
    assert "without --report" in one_line(svo("detect", CART, LOG, "--out", tmp_path / "out", "--states", "true_speed"))
    assert not (tmp_path / "out").exists()


def test_results_that_are_replaced_leave_no_report_about_others(tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = ("detect", CART, LOG, "--out", out)
    assert svo(*command, "--report", "--format", "svg").exit_code == 0
    (out / "pictures" / "mine.txt").write_text("kept")
    assert svo(*command, "--overwrite").exit_code == 0
    assert not (out / "report.html").exists()
    assert [path.name for path in (out / "pictures").iterdir()] == ["mine.txt"]


# -- logs of all kinds -------------------------------------------------------------------------------------


def test_no_alarm_is_no_proof_of_health(tmp_path: Path) -> None:
    text = text_of(report_of(cart(slice(0, 40)), tmp_path))
    assert "No model was falsified" in text
    assert "no proof of health" in text
    assert "a log in memory" not in text


@pytest.mark.parametrize("samples", [1, 2, 60])
def test_an_alarm_in_the_first_sample_leaves_no_bounds(tmp_path: Path, samples: int) -> None:
    y = cart().log.y.copy()
    y[0] += 9.0
    found = cart(slice(0, samples), y=y)
    page = report_of(found, tmp_path)
    assert "readings of sample 0 (0.0 s)" in page
    assert len(drawn_in(page)) == 3
    (_, position, _) = pictures_of(found.record, None)
    (panel,) = position.timeline.panels
    assert all(np.isnan(end).all() for ends in panel.bounds.values() for end in ends)


def test_readings_that_are_missing_are_counted_and_widen_the_bounds(tmp_path: Path) -> None:
    y = cart().log.y.copy()
    y[10:22] = np.nan
    found = cart(slice(0, 49), y=y)
    assert "position: 12 of 49" in report_of(found, tmp_path)
    lower, upper = found.record.boxes["nominal"]
    assert upper[20, 0] - lower[20, 0] > 5 * (upper[9, 0] - lower[9, 0])


def test_nothing_that_stands_out_is_lost_in_a_long_log() -> None:
    """Of 20 samples in a column of the picture the one that stands out is drawn, inside or as a mark at the edge."""
    plant = find_plant(CART)
    samples, at = 20_000, 14_007
    y = 0.02 * np.sin(np.arange(samples))[:, None]
    y[at] = 9.0
    found = detect(plant, Log(np.arange(samples) * 0.1, np.zeros((samples, 1)), y))
    assert found.record.falsified_at == at
    (_, position, _) = pictures_of(found.record, None)
    panel = position.figure().axes[0].child_axes[0]
    marks = [line for line in panel.lines if line.get_marker() == "^"]
    edges = [line for line in marks if len(line.get_xdata()) == 1]
    assert len(edges) == 1
    assert abs(float(edges[0].get_xdata()[0]) - at * 0.1) <= samples * 0.1 / 1000
    assert sum(len(line.get_xdata()) for line in panel.lines) < 2500


@pytest.mark.parametrize("name", ["eclipse", "elevator"])
def test_plants_that_are_registered_have_reports_too(tmp_path: Path, name: str) -> None:
    plant = load_plant(name)
    fault, profiles = next(iter(plant.faults.items()))
    whole = plant.simulate(fault, profiles[0], plant.noise_sets[0], 0)
    log = Log(whole.time[:120], whole.u[:120], whole.y[:120], source="flight.csv")
    found = detect(plant, log)
    page = report_of(found, tmp_path, channels=[found.record.labels.states[0]])
    assert len(drawn_in(page)) == 2
    assert plant.noise_sets[0] in page


def test_a_nonlinear_plant_has_a_report_with_the_bounds_of_its_parameters(tmp_path: Path) -> None:
    tanks = find_plant(CART.with_name("two_tanks.toml"))
    found = detect(tanks, read_log(CART.with_name("two_tanks.csv"), tanks))
    bank = bank_of(found)
    rows = {row[0]: row[1:] for row in bounds_table(found, bank).rows}
    models = list(bank.observers)
    assert dict(zip(models, rows["parameter hole"], strict=True))["leak"] == "0 to 0.2"
    assert set(rows["disturbance d1"]) == {"± 0.002"}
    assert set(rows["parameter area"]) == {"154"}
    assert set(rows["noise of level 2 [cm]"]) == {"± 0.1"}
    assert len(drawn_in(report_of(found, tmp_path))) == 3


def test_names_of_somebody_else_stay_text(tmp_path: Path) -> None:
    text = CART.read_text(encoding="utf-8").replace('"A cart with a motor and a position sensor"', f"'{EVIL}'")
    (tmp_path / "my.toml").write_text(text.replace('name = "mass"', f"name = '{EVIL}'"), encoding="utf-8")
    (log := tmp_path / "log<b>.csv").write_bytes(LOG.read_bytes())
    assert svo("detect", tmp_path / "my.toml", log, "--out", tmp_path / "out", "--report").exit_code == 0
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<img" not in page
    assert "49" not in re.findall(r"<h1>(.*?)</h1>", page)[0]
    assert "log<b>" not in page
    assert "&lt;img src=x" in page


def test_options_name_each_thing_once() -> None:
    options = ReportOptions.of(["a, b", "a"], ["SVG,png", "svg"])
    assert (options.channels, options.formats) == (("a", "b"), ("svg", "png"))


def test_what_reading_added_to_the_noise_is_told_by_sensor_and_unit() -> None:
    found = cart()
    assert "widening of the noise by reading" not in log_facts(found, None)
    rounded = replace(found, log=replace(found.log, widening=np.array([5e-4])))
    assert log_facts(rounded, None)["widening of the noise by reading"] == "position [m]: 0.0005"
