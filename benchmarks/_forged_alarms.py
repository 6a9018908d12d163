"""Alarms of small plants that are edited; `svo verify`, with a log and in full, judges them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._claims import Truth, of_plant, of_window, one_reading, set_of
from benchmarks._exact_witness import witness
from benchmarks._forged_edits import TEXT, Random, file_of, forged, one_of
from svo import detect, find_plant, read_log, verify
from svo.detection.chains import PlantModels
from svo.detection.plant_record import plant_record
from svo.isolation.alarm_record import Alarm, alarm_line, digest_of_record
from svo.isolation.alarms import read_alarms, verify_alarms
from svo.logs.log import Log
from svo.observers.window.certificate import WindowCertificate
from tests.svo.detection.proof_cases import random_plant

EXAMPLES = Path(__file__).parents[1] / "docs" / "examples"


def with_sums(record: Any, rng: Random) -> None:
    """Bounds of sums, over anything."""
    c = record["certificate"]
    if not isinstance(c, dict) or not isinstance(c.get("samples"), list):
        return
    count, r = len(c["samples"]), int(rng.integers(1, 3))
    numbers = lambda values: {"shape": [r], "hex": " ".join(float(v).hex() if v else "0" for v in values)}  # noqa: E731
    ends = rng.integers(-1, count + 1, (2, r)) + (c["first"] if isinstance(c.get("first"), int) else 0)
    half = np.abs(rng.normal(size=r)) * rng.choice([1e-3, 1.0, 10.0])
    c["sums"] = {
        "column": rng.integers(-1, 4, r).tolist(), "first": ends[0].tolist(), "last": ends[1].tolist(),
        "lower": numbers(-half), "upper": numbers(half), "on_sum": numbers(rng.normal(size=r)),
    }  # fmt: skip


def certain(record: Any, rng: Random) -> None:
    """What would prove anything: no noise, no output, no disturbance, no way for the state to be where it is."""
    c = record["certificate"]
    name = str(rng.choice(["noise", "w_lower", "w_upper", "y", "slack", "remainder", "stacks", "box_upper", "lines"]))
    value = float(rng.choice([0.0, -1.0, 1e-300, 1.0]))

    def change(part: Any) -> None:
        if isinstance(part, dict):
            for key, entry in part.items():
                if key == name and isinstance(entry, dict) and isinstance(entry.get("hex"), str) and entry["hex"]:
                    entry["hex"] = " ".join([value.hex() if value else "0"] * (entry["hex"].count(" ") + 1))
                else:
                    change(entry)
        elif isinstance(part, list):
            for entry in part:
                change(entry)

    change(c)
    change(record.get("matrices"))


MORE = {"sums": with_sums, "certain": certain}


class Records:
    """Alarms of a cart, two tanks and a scheduled plant, each edited and verified."""

    def __init__(self) -> None:
        self._cases: list[tuple[Any, Log, list[Any]]] = []
        for name in ("cart", "two_tanks"):
            plant = find_plant(str(EXAMPLES / f"{name}.toml"))
            self._add(plant, read_log(EXAMPLES / f"{name}.csv", plant))
        for seed in (7, 2):
            plant, log = random_plant(seed)
            self._add(plant, Log(log.time, log.u, log.y))
        self._truth = Truth()

    def _add(self, plant: Any, log: Log) -> None:
        found = detect(plant, log, noise="stated").alarms
        self._cases.append((plant, log, [json.loads(alarm_line(alarm)) for alarm in found]))

    def _file(self, rng: Random, folder: Path) -> tuple[str, Path, Any, Log]:
        plant, log, records = one_of([case for case in self._cases if case[2] and self._takes(case[0])], rng)
        kind, record = forged(one_of(records, rng), rng, MORE)
        line = json.dumps(
            record | {"sha256": digest_of_record(record)} if isinstance(record, dict) else record, sort_keys=True
        )
        if rng.random() < 0.15:
            kind = str(one_of(sorted(TEXT), rng))
            line = TEXT[kind](line, rng)
        behind, content = file_of([line], rng, is_packed=False)
        path = folder / "alarms.jsonl"
        path.write_bytes(content)
        return behind or kind, path, plant, log

    def _takes(self, plant: Any) -> bool:
        return True

    def _said(self, path: Path, log: Log, plant: Any) -> bool:
        raise NotImplementedError

    def _is_false(self, alarm: Alarm, log: Log, plant: Any) -> str | None:
        raise NotImplementedError

    def __call__(self, rng: Random, folder: Path) -> tuple[str, str]:
        kind, path, plant, log = self._file(rng, folder)
        try:
            accepted = self._said(path, log, plant)
        except (ValueError, OSError):
            accepted = False
        if not accepted:
            return kind, "refused"
        if not one_reading(path.read_bytes()):
            return kind, "false: two programs read two files"
        for alarm in read_alarms(path):
            if (why := self._is_false(alarm, log, plant)) is not None:
                return kind, f"false: {why}"
        return kind, "still true"


class Plain(Records):
    """``svo verify``: the claim is about the record's own numbers."""

    def _said(self, path: Path, log: Log, plant: Any) -> bool:
        return any(check.ok for check in verify_alarms(path))

    def _is_false(self, alarm: Alarm, log: Log, plant: Any) -> str | None:
        c = alarm.certificate
        assert isinstance(c, WindowCertificate)
        return "explained by its own numbers" if witness(*of_window(c)) else None


class WithLog(Records):
    """``svo verify --log``: the numbers are the plant's, in the log; of linearisations, the record's own."""

    def _said(self, path: Path, log: Log, plant: Any) -> bool:
        return all(check.ok for check in verify_alarms(path, log, PlantModels(plant, log).difference))

    def _is_false(self, alarm: Alarm, log: Log, plant: Any) -> str | None:
        c = alarm.certificate
        assert isinstance(c, WindowCertificate)
        if log.time[alarm.sample] != alarm.time:
            return "another time"
        first = alarm.sample + 1 - len(c.samples)
        models = plant_record(plant, "stated", log)["observers"]
        if alarm.observer not in models:
            return "no such observer"
        if "matrices" not in models[alarm.observer]:
            used = [~np.isnan(s.y) for s in c.samples]
            if any(
                not (s.y[at] == log.y[first + k][at]).all()
                for k, (s, at) in enumerate(zip(c.samples, used, strict=True))
            ):
                return "other readings"
            return "explained by its own numbers" if witness(*of_window(c)) else None
        instants, delta = of_plant(models[alarm.observer], log, first, alarm.sample)
        if not c.late:
            instants[-1] = replace(
                instants[-1], more=[m for m in instants[-1].more if not m[0][len(m[0]) - c.w_rows.shape[1] :].any()]
            )
        claim = of_window(c, instants)
        return "explained by the plant" if witness(claim[0], claim[1], delta) else None


class Full(Records):
    """``svo verify --full``: a trajectory from the first set explains the log up to the alarm, or none does."""

    def _takes(self, plant: Any) -> bool:
        return "two_tanks" not in str(plant.name)

    def _said(self, path: Path, log: Log, plant: Any) -> bool:
        return verify(path, log, full=True, plant=plant).ok

    def _is_false(self, alarm: Alarm, log: Log, plant: Any) -> str | None:
        if log.time[alarm.sample] != alarm.time:
            return "another time"
        models = plant_record(plant, "stated", log)["observers"]
        if alarm.observer not in models:
            return "no such observer"

        def ask() -> bool:
            instants, delta = of_plant(models[alarm.observer], log, 0, alarm.sample)
            return witness(instants, set_of(models[alarm.observer]["first"]), delta)

        explained = self._truth.explained((str(plant.name), len(log), alarm.observer, alarm.sample), ask)
        return "explained from the first sample on" if explained else None
