from __future__ import annotations

import base64
import hashlib
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from polytopes import HPolytope
from svo.pictures.style import in_seconds, rows_of_axes
from svo.plant import Column, Plant, load_plant
from svo.studies.isolation import plots
from svo.studies.isolation.exemplar import Exemplar, Snapshot
from svo.studies.isolation.figures import write_pictures
from svo.studies.isolation.publish import write_report
from svo.studies.isolation.run import RunRow
from svo.studies.isolation.summary import ConditionSummary, summarise
from svo.studies.page import write_page

STATES = (Column("speed_m_s", "m/s"), Column("angle_rad", "rad"), Column("rate", "rad/s"))
NAMES = ("nominal", "leak", "gauge")


def exemplar(fault: str = "leak", profile: str = "step", n: int = 3) -> Exemplar:
    """A run of 40 samples in which state 1 of the leak model drifts away and the nominal model falls at sample 20."""
    time = np.arange(40) * 0.1
    centre = np.zeros((40, 3, n))
    centre[:, 1, min(1, n - 1)] = np.linspace(0.0, 1.5, 40)
    lower, upper = centre - 1.0, centre + 1.0
    alive = np.ones((40, 3), dtype=bool)
    alive[20:, 0] = alive[25:, 2] = False
    lower[~alive] = upper[~alive] = np.nan
    sets = {name: HPolytope.box(lower[19, i], upper[19, i]) for i, name in enumerate(NAMES)}
    end = {"leak": HPolytope.box(lower[-1, 1], upper[-1, 1])}
    snapshots = (Snapshot(19, "nominal falsified next", sets), Snapshot(39, "end of the run", end))
    return Exemplar(fault, profile, "calm", NAMES, time, alive, lower, upper, centre[:, 1], snapshots)


def row(run: int, fault: str, profile: str, isolated: float | None) -> RunRow:
    detected = None if fault == "none" else 0.1 + 0.1 * (run % 3)
    alone = None if isolated is None else fault
    return RunRow(
        run, run, fault, profile, "calm", None, detected, isolated, alone, False, False, "leak, gauge", 9.0, 20.0, 0
    )


@pytest.fixture
def tank(registered_tank: str) -> Plant:
    return load_plant(registered_tank)


@pytest.fixture
def summaries() -> list[ConditionSummary]:
    kinds = [("none", "none", None), ("leak", "step", 0.4), ("leak", "ramp", None), ("gauge", "step", 0.2)]
    rows = [row(i, fault, profile, isolated) for fault, profile, isolated in kinds for i in range(4)]
    rows.append(row(9, "gauge", "step", None))
    return summarise(rows)


def axes() -> Any:
    return Figure().subplots()


def test_points_show_means_counts_and_the_papers_figures(tank: Plant, summaries: list[ConditionSummary]) -> None:
    ax = axes()
    artists = plots.plot_delays(summaries, tank.Ts, tank.reference, ax)
    detect, isolate = (line.get_ydata() for line in ax.lines if line.get_marker() == "o")
    assert detect == pytest.approx([0.175, 0.175, 0.16])
    assert isolate == pytest.approx([0.4, np.nan, 0.2], nan_ok=True)  # never isolated: no point, and "0/4" says why
    assert not ax.patches  # a bar on a logarithmic axis would begin anywhere
    assert {text.get_text() for text in ax.texts} == {"0/4", "4/5"}
    marks = {line.get_marker(): line.get_ydata()[0] for line in ax.lines if line.get_marker() in "Dv"}
    assert marks["v"] == 0.5
    assert ax.get_yscale() == "log"
    assert set(ax.lines) <= set(artists)


def test_pictures_are_written_in_the_formats_asked_for(
    tank: Plant, summaries: list[ConditionSummary], tmp_path: Path
) -> None:
    runs = [exemplar(n=1), exemplar("leak", "ramp", n=1), exemplar("gauge", n=1)]
    pictures = write_pictures(tmp_path, tank, summaries, runs, ("svg", "pdf"))
    stems = {picture.path.stem for picture in pictures}
    assert {path.name for path in tmp_path.iterdir()} == {
        f"{s}.{kind}" for s in stems for kind in ("png", "svg", "pdf")
    }
    assert all(picture.path.suffix == ".png" for picture in pictures)  # which the page shows
    begins = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}
    assert all(path.read_bytes().startswith(begins[path.suffix[1:]]) for path in tmp_path.iterdir())
    with pytest.raises(ValueError, match="format is 'gif'; expected one of png, svg, pdf"):
        write_pictures(tmp_path, tank, summaries, runs, ("gif",))


def test_no_panel_is_blank() -> None:
    figure = Figure()
    rows = rows_of_axes(figure, [3, 1, 2])
    assert [len(row) for row in rows] == [3, 1, 2]
    assert len(figure.axes) == 6


def test_a_bar_of_life_ends_with_the_delay(tank: Plant) -> None:
    ax = axes()
    plots.plot_alive(exemplar(), tank.fault_time, tank.Ts, ax)
    nominal, leak, gauge = (patch.get_x() + patch.get_width() for patch in ax.patches)
    assert (nominal, gauge) == pytest.approx((1.1, 1.6))  # fault at 1.0 s, alarm at 2.0 s, plus one sampling time
    assert leak == pytest.approx(ax.get_xlim()[1])
    assert [text.get_text().strip() for text in ax.texts] == ["1.1 s", "1.6 s"]


def test_sets_are_drawn_with_the_true_state_in_them(tank: Plant) -> None:
    ax, run = axes(), exemplar()
    plots.plot_sets(run, run.snapshots[0], (0, 1), STATES, ax)
    assert len(ax.patches) == 3
    cross = next(line for line in ax.lines if line.get_marker() == "x")
    assert (cross.get_xdata()[0], cross.get_ydata()[0]) == tuple(run.x[19, :2])
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("speed [m/s]", "angle [rad]")


def test_states_that_separate_the_models_are_chosen() -> None:
    assert 1 in plots.separating_states(exemplar())
    assert plots.separating_states(exemplar(n=1)) == (0,)


def test_panels_make_their_own_axes_and_show_nothing(tank: Plant, monkeypatch: pytest.MonkeyPatch) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    monkeypatch.setattr(plt, "show", lambda: pytest.fail("show was called"))
    artists = plots.plot_bounds(exemplar(), 1, STATES, tank.fault_time)
    assert artists[0].axes is not None
    plt.close("all")


class References(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.tags: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.found += [value or "" for name, value in attrs if name in ("src", "href", "srcset", "data")]


def test_the_report_is_one_file_that_refers_to_nothing_outside(
    tank: Plant, summaries: list[ConditionSummary], tmp_path: Path
) -> None:
    runs = [exemplar(fault, profile, n=1) for fault, profile in (("leak", "step"), ("leak", "ramp"), ("gauge", "step"))]
    pictures = write_pictures(tmp_path, tank, summaries, runs)
    assert [picture.path.name for picture in pictures] == ["delays_calm.png", "alive_calm.png", "bounds_calm.png"]
    facts = {"plant": "tank", "noise": ["calm"], "faults": ["none", "leak"], "runs": 4, "seed": 0}
    identity = {"configuration": facts, "versions": {"numpy": "<2>"}}
    write_report(tmp_path / "report.html", tank, identity, summaries, pictures)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    parser = References()
    parser.feed(text)
    assert len(parser.found) == 3
    assert all(value.startswith("data:image/png;base64,") for value in parser.found)
    assert not parser.tags & {"script", "link", "iframe", "with"}
    assert "url(" not in text
    assert "@import" not in text
    assert "Water tank &lt;with&gt; two gauges" in text
    assert "Not isolated, calm noise: leak ramp in 4 of 4 runs; alive at the end: leak, gauge (4)." in text
    for word in ("undecided", "wrong isolation", "&lt;2&gt;", "prefers-color-scheme", "viewport"):
        assert word in text


def test_a_page_runs_its_own_script_and_loads_nothing(tmp_path: Path) -> None:
    write_page(tmp_path / "page.html", "A <page>", ["<p>text</p>"], script="const a = 1 < 2;\n")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    (policy,) = re.findall(r'<meta http-equiv="Content-Security-Policy" content="(.*?)">', text)
    given = dict(part.split(" ", 1) for part in policy.split("; "))
    assert (given["default-src"], given["img-src"], given["base-uri"]) == ("'none'", "data:", "'none'")
    for element in ("style", "script"):
        (inside,) = re.findall(rf"<{element}>(.*?)</{element}>", text, re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(inside.encode()).digest()).decode()
        assert given[f"{element}-src"] == f"'sha256-{digest}'"
    write_page(tmp_path / "page.html", "A page", [])
    assert "script" not in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_sets_are_pictured_where_there_are_two_states(
    tank: Plant, summaries: list[ConditionSummary], tmp_path: Path
) -> None:
    from dataclasses import replace

    columns = replace(tank.columns, states=STATES)
    wide = replace(tank, columns=columns)  # type: ignore[type-var]
    pictures = write_pictures(tmp_path, wide, summaries, [exemplar(), exemplar("gauge")])
    assert "sets_calm.png" in [picture.path.name for picture in pictures]


def test_fault_free_studies_have_no_pictures(tank: Plant, summaries: list[ConditionSummary], tmp_path: Path) -> None:
    assert write_pictures(tmp_path, tank, summaries[:1], [exemplar("none", "none")]) == []


@pytest.mark.parametrize(
    ("time", "Ts", "text"),
    [
        (21.0, 1.0, "21 s"),
        (0.0042, 0.0002, "0.0042 s"),
        (0.003, 0.001, "0.003 s"),
        (0.5, 0.01, "0.50 s"),
        (0.075, 0.025, "0.075 s"),
        (3e-6, 1e-6, "0.000003 s"),
        (2.0, 1 / 3, "2.000000 s"),
        (600.0, 60.0, "600 s"),
    ],
)
def test_times_have_the_digits_of_the_sampling_time(time: float, Ts: float, text: str) -> None:
    """0.00 s for a plant with 0.2 ms, 21.00 s with 1 s."""
    assert in_seconds(time, Ts) == text
    assert in_seconds(time, Ts, "+") == f"+{text}"


def test_pictures_write_times_in_the_digits_of_the_sampling_time() -> None:
    for Ts, text in ((0.0002, "  0.0020 s"), (1.0, "  10 s")):
        run = exemplar()
        run = Exemplar(**{**vars(run), "time": run.time * Ts / 0.1}) if hasattr(run, "__dict__") else run
        ax = Figure().subplots()
        plots.plot_alive(run, 11 * Ts, Ts, ax)
        assert ax.texts[0].get_text() == text
