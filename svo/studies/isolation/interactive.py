"""What the report's script draws: every run as a dot, and one run of each kind sample by sample, as compact JSON."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from svo.pages.page import render
from svo.pictures.style import colours
from svo.plant import HEALTHY, Plant, fault_start
from svo.studies.isolation.exemplar import Exemplar
from svo.studies.isolation.plots import separating_states, time_window
from svo.studies.isolation.run import RunRow
from svo.studies.isolation.tables import bank_titles

_FRAMES = 160  # samples of a run that the page holds; more would only make it heavier
_DIGITS = 6


def interactive_section(plant: Plant, rows: Sequence[RunRow], exemplars: Iterable[Exemplar]) -> Markup:
    """HTML of both views with their data, for the script report.js; nothing is loaded from elsewhere.

    Parameters
    ----------
    plant : Plant
        For its name, units and the time of the fault.
    rows : sequence of RunRow
    exemplars : iterable of Exemplar
        Those of fault-free runs are left out: nothing happens in them. Without any other the section is empty.
    """
    flights = [_flight(plant, e) for e in exemplars if e.fault != HEALTHY]
    if not flights:
        return Markup()
    among = bank_titles(rows)
    runs = [_run(row, among[row.bank]) for row in rows]
    data = {"plant": plant.name, "Ts": plant.Ts, "runs": runs, "flights": flights}
    # "<" cannot end the script element from inside a string.
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return render("interactive.html.j2", flights=flights, data=text)


def _run(row: RunRow, among: str) -> dict[str, Any]:
    """One run, and how its bank is told from others."""
    return {
        "run": row.run,
        "seed": row.seed,
        "fault": row.fault,
        "profile": row.profile,
        "noise": row.noise,
        "detect": row.detection_delay_s,
        "isolate": row.isolation_delay_s,
        "as": row.isolated_as,
        "false": row.false_alarm,
        "wrong": row.wrong_isolation,
        "bank": row.bank.title,
        "among": among,
    }


def _flight(plant: Plant, exemplar: Exemplar) -> dict[str, Any]:
    """Boxes of the two states that tell the models apart, around the fault and the falsifications."""
    onset = fault_start(plant, exemplar.fault, exemplar.profile)
    begin, end = time_window(exemplar, onset, plant.Ts)
    after = exemplar.time - onset
    inside = np.flatnonzero((after >= begin) & (after <= end))
    falls = [exemplar.died_at(i) for i in range(len(exemplar.names))]
    fallen = np.array([k for k in falls if k is not None], dtype=int)
    events = np.intersect1d(inside, np.concatenate([fallen, fallen - 1]))
    kept = np.union1d(inside[:: -(-inside.size // _FRAMES)], events)  # never without the samples that matter
    states = list(separating_states(exemplar))
    tone = colours(exemplar.names)
    models = [
        {
            "name": name,
            "colour": tone[name],
            "dies": _place(falls[i], kept),
            "lower": _numbers(exemplar.lower[kept, i][:, states]),
            "upper": _numbers(exemplar.upper[kept, i][:, states]),
        }
        for i, name in enumerate(exemplar.names)
    ]
    of = exemplar.fault, exemplar.profile, f"{exemplar.noise} noise", exemplar.bank.title
    return {
        "title": ", ".join(filter(None, of)),
        "axes": [plant.columns.states[i].bounded for i in states],
        "time": _numbers(after[kept]),
        "true": _numbers(exemplar.x[kept][:, states]),
        "models": models,
    }


def _place(sample: int | None, kept: np.ndarray) -> int | None:
    """Where a sample stands among those kept; None if it comes after them or never."""
    return None if sample is None or sample > kept[-1] else int(np.searchsorted(kept, sample))


def _numbers(values: np.ndarray) -> list[Any]:
    """Nested lists of floats with few digits; None where there is no bound."""
    if values.ndim > 1:
        return [_numbers(row) for row in values]
    return [float(f"{v:.{_DIGITS}g}") if np.isfinite(v) else None for v in values.tolist()]
