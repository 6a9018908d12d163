"""What a watch shows to a program: one JSON object a line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from math import inf
from time import monotonic
from typing import Any, TextIO

from svo.detection.watch.session import Session, Status
from svo.detection.watch.view import SECONDS_BETWEEN_LINES, conclusion
from svo.isolation import Alarm
from svo.terminal import json_text


class JsonView:
    """An ``event`` a line: "alarm", "note", "status" (one each second in which data come) and "end"."""

    def __init__(self, file: TextIO, session: Session) -> None:
        self._file, self._session = file, session
        self._latest, self._shown = -inf, 0

    def alarm(self, alarm: Alarm) -> None:
        proven = alarm.certificate.verify()
        about = {"time_s": alarm.time, "sample": alarm.sample, "observer": alarm.observer, "proven": proven}
        self._print("alarm", about)
        self._latest = -inf

    def note(self, text: str) -> None:
        self._print("note", {"text": text})

    def show(self, status: Callable[[], Status | None], waiting: int) -> None:
        now = monotonic()
        if now - self._latest < SECONDS_BETWEEN_LINES or self._session.samples == self._shown:
            return
        found = status()
        if found is not None:
            self._print("status", self._of(found))
            self._latest, self._shown = now, found.samples

    def close(self, status: Status | None, why: str) -> None:
        self._print("end", {"why": why} | ({"samples": 0} if status is None else self._of(status)))

    def _of(self, status: Status) -> dict[str, Any]:
        verdict = status.verdict
        return {
            "time_s": status.time,
            "samples": status.samples,
            "state": verdict.state,
            "fault": verdict.fault,
            "alive": list(verdict.alive),
            "falsified_s": dict(status.dead),
            "undecided": status.undecided,
            "bounds": {name: self._bounds(*box) for name, box in status.boxes.items()},
            "conclusion": conclusion(status),
            **asdict(status.counts),
        }

    def _bounds(self, lower: Any, upper: Any) -> dict[str, list[float]]:
        ends = zip(lower.tolist(), upper.tolist(), strict=True)
        return {state: [low, high] for state, (low, high) in zip(self._session.states, ends, strict=False)}

    def _print(self, event: str, about: Mapping[str, Any]) -> None:
        self._file.write(json_text({"event": event, **about}) + "\n")
        self._file.flush()
