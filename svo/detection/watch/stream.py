"""Lines of standard input, or of another stream: they come once, and its end is the end."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from queue import Empty, Queue
from threading import Thread
from time import monotonic
from typing import Any

from svo.detection.watch.lines import CHUNK, Line, Notice, Splitter
from svo.logs.lines import no_end


class StreamLines:
    """Lines of an open file descriptor, that of standard input by default."""

    def __init__(self, descriptor: int | None = None, name: str = "standard input") -> None:
        self.name = name
        self._splitter = Splitter()
        self._chunks: Queue[bytes] = Queue(maxsize=64)
        self._ended = False
        # A thread, so that silence does not keep the view from being drawn; it dies with the program.
        Thread(target=self._pump, args=(sys.stdin.fileno() if descriptor is None else descriptor,), daemon=True).start()

    def read(self, wait: float) -> list[Line | Notice] | None:
        """See `svo.detection.watch.lines.Lines`."""
        if self._ended:
            return None
        end = monotonic() + wait
        while True:
            try:
                chunk = self._chunks.get(timeout=max(0.0, end - monotonic()))
            except Empty:
                return []
            if not chunk:
                self._ended = True
                half = self._splitter.half
                return [Notice(f"{self.name}: {no_end(half)}")] if half else []
            lines: list[Line | Notice] = [*self._splitter.add(chunk)]
            if lines:
                return lines

    def state(self) -> dict[str, Any]:
        """Nothing: what was read of a stream cannot be read again."""
        return {}

    def resume(self, state: Mapping[str, Any]) -> None:
        """The stream goes on where it is."""

    def close(self) -> None:
        """Nothing: the stream belongs to the program."""

    def _pump(self, descriptor: int) -> None:
        chunk = b"?"
        while chunk:
            try:
                chunk = os.read(descriptor, CHUNK)
            except OSError:  # closed under our hands, or the terminal is gone
                chunk = b""
            self._chunks.put(chunk)
