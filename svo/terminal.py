"""Output to people: what other programs named (columns, faults, files) cannot steer the terminal that shows it.

All output of the command line goes through here. Control characters are shown as ``\\u001b``, as JSON writes them, so
that JSON stays JSON; what the terminal's encoding cannot say is shown the same way instead of ending the command.
"""

from __future__ import annotations

import io
import json
import math
import os
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, TextIO

if TYPE_CHECKING:
    from rich.console import Console

# C0 but for tab and line feed, DEL and C1; marks that turn the direction of writing; line separators; lone surrogates,
# as names of files have them that are no text.
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")


class ReaderGoneError(BrokenPipeError):
    """Whoever read the output (``| head``) has closed it."""


def plain(text: str) -> str:
    """The text with its control characters shown; line feeds and tabs stay."""
    return _CONTROL.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def line(text: str) -> str:
    """The text as one line: line feeds and tabs are shown too."""
    return plain(text).replace("\n", "\\u000a").replace("\t", "\\u0009")


def json_text(value: Any, indent: int | None = None) -> str:
    """A value as JSON, in which NaN and infinities, which JSON has not, are null."""
    return json.dumps(_without_nan(value), indent=indent, allow_nan=False)


def _without_nan(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


@contextmanager
def safe_output() -> Iterator[None]:
    """Standard output and error show control characters, for as long as the block lasts."""
    before = sys.stdout, sys.stderr
    for stream in before:
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    sys.stdout, sys.stderr = _Plain(sys.stdout), _Plain(sys.stderr)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
        for stream in before:
            _flush_or_drop(stream)


def console(*, stderr: bool = False, **options: Any) -> Console:
    """A rich console on standard output (or error): its own colours and cursor moves pass, what it shows is plain."""
    from rich.console import Console
    from rich.segment import Segment

    class SafeConsole(Console):
        def render(self, *arguments: Any, **named: Any) -> Iterable[Segment]:
            for segment in super().render(*arguments, **named):
                yield segment if segment.control else segment._replace(text=plain(segment.text))

    stream: Any = sys.stderr if stderr else sys.stdout
    file: Any = _Raw(stream.stream) if isinstance(stream, _Plain) else stream
    return SafeConsole(file=file, **options)


class _Raw:
    """A text stream that says whose pipe is broken. It has no ``buffer`` by which it could be passed by."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream

    def write(self, text: str) -> int:
        with _reader_that_may_go():
            return self.stream.write(text)

    def flush(self) -> None:
        with _reader_that_may_go():
            self.stream.flush()

    def __getattr__(self, name: str) -> Any:
        if name == "buffer":
            raise AttributeError(name)
        return getattr(self.stream, name)


class _Plain(_Raw):
    """A text stream that shows control characters."""

    def write(self, text: str) -> int:
        super().write(plain(text))
        return len(text)


@contextmanager
def _reader_that_may_go() -> Iterator[None]:
    try:
        yield
    except BrokenPipeError as error:
        raise ReaderGoneError(error.errno, error.strerror) from error


def _flush_or_drop(stream: TextIO) -> None:
    """Flush, or forget what nobody reads: else the interpreter complains about it when it ends."""
    try:
        stream.flush()
    except BrokenPipeError:
        with suppress(OSError, ValueError):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())
            os.close(nowhere)
    except ValueError:  # closed already
        pass
