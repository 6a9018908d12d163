"""The seal of a part file: what it is a part of, and a SHA-256 of all its bytes, checked before anything reads them.

It is one JSON object in the file's own text or metadata, so that a part is one file and stays readable by everyone.
The digest is that of the file with zeros in the digest's place.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass

_ZEROS = "0" * 64
_OPEN = b'{"svo-part": 1, '
_SEAL = re.compile(rb'\{"svo-part": 1, [^\x00-\x1f]*?"sha256": "([0-9a-f]{64})"\}')


@dataclass(frozen=True)
class Seal:
    """What a part is: its study (a digest), its number there, and the SHA-256 of files that belong to it, by kind."""

    study: str
    run: int
    attached: Mapping[str, str]

    def blank(self) -> str:
        """The text to put into the file, for `sealed` to complete."""
        fields = {"svo-part": 1, "study": self.study, "run": self.run, "attached": dict(self.attached)}
        return json.dumps(fields | {"sha256": _ZEROS})


def sealed(content: bytes) -> bytes:
    """A file with a blank seal in it, completed."""
    _, begin = _find(content)
    digest = hashlib.sha256(content).hexdigest()
    return content[:begin] + digest.encode() + content[begin + 64 :]


def read_seal(content: bytes) -> Seal:
    """The seal of a file.

    Raises
    ------
    ValueError
        If there is none, or it is not that of these bytes.
    """
    text, begin = _find(content)
    blank = content[:begin] + _ZEROS.encode() + content[begin + 64 :]
    if hashlib.sha256(blank).hexdigest().encode() != content[begin : begin + 64]:
        raise ValueError("its checksum does not match, so it was cut off or changed")
    fields = json.loads(text)
    return Seal(fields["study"], fields["run"], fields["attached"])


def _find(content: bytes) -> tuple[bytes, int]:
    """Text of the last seal in a file, and where its digest begins."""
    at = content.rfind(_OPEN)
    found = _SEAL.match(content, at) if at >= 0 else None
    if found is None:
        raise ValueError("it has no seal of a study's part, so it was cut off, changed or written by something else")
    return found[0], found.start(1)
