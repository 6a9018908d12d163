"""Records that show themselves: when a model fell, its bounds when they are asked for, pictures and tables."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.artist import Artist
from matplotlib.collections import PolyCollection

from polytopes import HPolytope
from svo import (
    ArchitectureI,
    ArchitectureII,
    BankRecord,
    Log,
    PolytopeObserver,
    UncertainModel,
    WindowObserver,
    detect,
    find_plant,
    read_log,
)
from svo.logs.drive import drive
from svo.pictures.timeline import thinned

CART = UncertainModel(
    [[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]], [[1.0, 0.0]], E=[[0.0], [0.1]], w=[0.2], n=[0.05], Ts=0.1,
    names={"states": ["position", "speed"], "outputs": ["gauge"]},
)  # fmt: skip
START = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"


@pytest.fixture(autouse=True)
def close() -> Any:
    yield
    plt.close("all")


def faulty(samples: int = 60) -> Log:
    log = CART.simulate([0.0, 0.0], np.ones((samples, 1)), np.random.default_rng(0))
    log.y[samples // 2 :] += 0.3
    return log


def bank(**options: Any) -> ArchitectureI:
    gauge = WindowObserver(CART.replace(n=[0.5]), START)
    drive_ = WindowObserver(CART.replace(w=[0.3]), START)
    return ArchitectureI(WindowObserver(CART, START), {"gauge": gauge, "drive": drive_}, **options)


def second(**options: Any) -> ArchitectureII:
    nominal, loose = WindowObserver(CART, START), WindowObserver(CART.replace(n=[0.5]), START)
    everything = WindowObserver(CART.replace(n=[0.6], w=[0.5]), START)
    return ArchitectureII(nominal, {"gauge": loose, "drive": WindowObserver(CART, START)}, everything, **options)


BANKS: dict[str, Callable[[], Any]] = {
    "I": bank,
    "I with debounce": lambda: bank(debounce=3),
    "I with recovery": lambda: bank(recovery=5),
    "II": second,
    "II with timeout": lambda: second(timeout=4),
}


def test_a_record_says_when_its_model_was_falsified() -> None:
    log = faulty()
    record = WindowObserver(CART, START).run(log)
    assert record.falsified_at == 30
    assert record.time is log.time
    healthy = WindowObserver(CART, START).run(
        replace(log, time=log.time[:30], u=log.u[:30], y=log.y[:30], x=log.x[:30])
    )  # type: ignore[index]
    assert healthy.falsified_at is None


def test_a_record_prints_a_line() -> None:
    assert repr(WindowObserver(CART, START).run(faulty())) == "<Record of 60 samples: falsified at sample 30 (3.0 s)>"
    printed = repr(bank().run(faulty(2000)))
    assert printed == "<BankRecord of 2000 samples: detected, isolated: gauge at 100.0 s; alive: gauge>"
    many = {f"a fault with a long name, number {i}": WindowObserver(CART, START) for i in range(40)}
    assert len(repr(ArchitectureI(WindowObserver(CART, START), many).run(faulty(20)))) < 400


@pytest.mark.parametrize("kind", BANKS)
def test_boxes_are_those_of_the_steps(kind: str) -> None:
    log = faulty()
    record, walked = BANKS[kind]().run(log), BANKS[kind]()
    wanted = {name: np.full((2, 60, 2), np.nan) for name in walked.observers}
    for verdict in drive(walked, log):
        for name, step in verdict.steps.items():
            if step.verdict != "falsified":
                wanted[name][:, verdict.sample] = step.box
    assert set(record.boxes) == set(wanted)
    assert any(np.isnan(boxes).any() for boxes in wanted.values())
    for name, boxes in wanted.items():
        assert np.allclose(record.boxes[name], boxes, rtol=1e-9, atol=1e-12, equal_nan=True), name


@pytest.mark.parametrize("kind", BANKS)
@pytest.mark.parametrize("ends", [(60,), (1, 2, 30, 31, 60), (29, 45, 60)])
def test_boxes_in_portions_are_those_of_the_whole_log(kind: str, ends: tuple[int, ...]) -> None:
    log = faulty()
    whole, followed, first = BANKS[kind]().run(log).boxes, BANKS[kind](), 0
    boxes = {name: np.full((60, 2, 2), np.nan) for name in followed.observers}
    for end in ends:
        rows = slice(max(first - 1, 0), end)
        part = replace(log, time=log.time[rows], u=log.u[rows], y=log.y[rows], x=None)
        *_, (verdict, _) = followed.follow(part, {name: box[rows] for name, box in boxes.items()}, start=int(first > 0))
        for name, step in verdict.steps.items():  # the bank stands at the end of the portion
            np.testing.assert_allclose(step.box, boxes[name][end - 1], rtol=1e-9, atol=1e-12)
        first = end
    for name, box in boxes.items():
        assert np.allclose(whole[name], (box[:, 0], box[:, 1]), rtol=1e-9, atol=1e-12, equal_nan=True), name


def test_boxes_are_computed_once_and_only_when_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    boxes = ArchitectureI._boxes
    monkeypatch.setattr(ArchitectureI, "_boxes", lambda self, log: (asked.append(log), boxes(self, log))[1])
    record = bank().run(faulty())
    assert (repr(record), record.falsified_at, asked) == (repr(record), 30, [])
    assert record.boxes is record.boxes
    assert len(asked) == 1


def test_a_pickled_record_keeps_the_boxes_that_were_asked_for() -> None:
    record = bank().run(faulty())
    with pytest.raises(ValueError, match=r"pickled; ask for record\.boxes first"):
        _ = pickle.loads(pickle.dumps(record)).boxes
    boxes = record.boxes["gauge"]
    assert np.array_equal(pickle.loads(pickle.dumps(record)).boxes["gauge"], boxes, equal_nan=True)


class Uncopied(WindowObserver):
    """One that holds what cannot be copied, as an observer of one's own may."""

    def __deepcopy__(self, memo: Any) -> Any:
        raise TypeError("a file is open")


def test_a_bank_that_cannot_be_copied_runs_and_says_why_it_has_no_boxes() -> None:
    record = ArchitectureI(Uncopied(CART, START), {}).run(faulty())
    assert record.falsified_at == 30
    with pytest.raises(ValueError, match=r"cannot be copied \(TypeError: a file is open\)"):
        _ = record.boxes


@cache
def pictures() -> dict[str, Callable[..., list[Artist]]]:
    plant = find_plant(EXAMPLE)
    gaps = faulty()
    gaps.y[5:20] = np.nan
    return {
        "record": WindowObserver(CART, START).run(faulty()).plot,
        "record of a polytope observer": PolytopeObserver(CART, START, max_facets=12).run(gaps).plot,
        "one sample": WindowObserver(CART, START).run(faulty(1)).plot,
        "bank": bank().run(faulty()).plot,
        "bank of kind II": second(timeout=4).run(gaps).plot,
        "long": bank().run(faulty(3000)).plot,
        "detection": detect(plant, read_log(EXAMPLE.with_suffix(".csv"), plant)).plot,
    }


NAMES = ("record", "record of a polytope observer", "one sample", "bank", "bank of kind II", "long", "detection")


@pytest.mark.parametrize(("name", "given"), [*((name, True) for name in NAMES), ("record", False), ("bank", False)])
def test_pictures_take_an_axis_and_return_what_they_drew(name: str, given: bool) -> None:
    figure, axes = plt.subplots(1, 2)
    artists = pictures()[name](axes[0] if given else None)
    drawn = artists[0].figure
    assert all(isinstance(artist, Artist) for artist in artists)
    assert (drawn is figure) is given
    assert drawn is not None
    drawn.canvas.draw()
    assert not axes[1].has_data()


def test_a_panel_shows_the_bounds_and_the_channels_that_were_chosen() -> None:
    plt.figure()
    record = bank().run(faulty())
    (ax,) = plt.gcf().subplots(1, 1, squeeze=False)[0]
    artists = record.plot(ax, channels=["speed"])
    panels = ax.child_axes
    assert [panel.get_title(loc="left") for panel in panels[1:]] == ["speed: bounds, true value as a line"]
    lower, upper = record.boxes["gauge"]
    (band,) = [a for a in artists if isinstance(a, PolyCollection) and a.get_facecolor()[0, 0] > 0.8]
    corners = np.vstack([path.vertices for path in band.get_paths()])
    for k in (0, 20, 59):
        at = corners[np.isclose(corners[:, 0], record.time[k])]
        assert at[:, 1].min() == pytest.approx(lower[k, 1], abs=1e-6)
        assert at[:, 1].max() == pytest.approx(upper[k, 1], abs=1e-6)
    with pytest.raises(ValueError, match="channels is 'height'; expected any of position, speed, gauge"):
        record.plot(channels=["height"])


def test_the_bounds_of_many_samples_are_drawn_outward() -> None:
    rng = np.random.default_rng(0)
    time = np.arange(12_345.0)
    lower, width = rng.standard_normal((2, time.size))
    lower[rng.random(time.size) < 0.4] = np.nan
    lower[5000:7000] = np.nan
    upper = lower + np.abs(width)
    times, low, high = thinned(time, lower, upper)
    at = np.searchsorted(times, time, side="right") - 1
    known = np.isfinite(lower)
    assert len(times) == 1000
    assert (low[at][known] <= lower[known]).all()
    assert (high[at][known] >= upper[known]).all()
    assert np.isnan(low[(times > 5050) & (times < 6950)]).all()


def test_titles_are_those_of_the_columns_and_say_what_is_shown() -> None:
    plant = find_plant(EXAMPLE)
    found = detect(plant, read_log(EXAMPLE.with_suffix(".csv"), plant))
    ax = plt.figure().add_subplot()
    found.plot(ax)
    titles = [panel.get_title(loc="left") for panel in ax.child_axes]
    assert titles == [
        "detected, isolated: sensor at 5.0 s",
        "position [m]: bounds, readings as dots, true value as a line",
        "speed [m/s]: bounds, true value as a line",
    ]
    found.plot(short := plt.figure().add_subplot(), channels=["speed"])  # as the title says it, too
    assert [panel.get_title(loc="left") for panel in short.child_axes[1:]] == titles[2:]
    assert [label.get_text() for label in ax.child_axes[0].get_yticklabels()] == ["bank", "nominal", "sensor", "motor"]


def test_a_table_has_a_row_a_sample() -> None:
    log = faulty()
    frame = WindowObserver(CART, START).run(log).to_dataframe()
    columns = ["position_lower", "position_upper", "speed_lower", "speed_upper"]
    assert list(frame.columns) == ["time_s", "verdict", "gauge", *columns]
    assert len(frame) == 60
    assert frame["verdict"][30] == "falsified"
    assert np.isnan(frame["speed_lower"][30])
    assert np.array_equal(frame["gauge"], log.y[:, 0])
    record: BankRecord = bank().run(log)
    frame = record.to_dataframe()
    assert list(frame.columns[:4]) == ["time_s", "state", "gauge", "nominal_alive"]
    assert frame["state"].tolist() == list(record.states)
    assert np.array_equal(frame["drive_speed_upper"], record.boxes["drive"][1][:, 1], equal_nan=True)
