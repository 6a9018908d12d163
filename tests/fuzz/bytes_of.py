"""Damage to the bytes of a file, as disks, networks and editors do it."""

from __future__ import annotations

import numpy as np


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """The same bytes but for one or a few accidents."""
    result = bytearray(data)
    for _ in range(int(rng.integers(1, 4))):
        if not result:
            break
        at = int(rng.integers(len(result)))
        match int(rng.integers(6)):
            case 0:
                result[at] ^= 1 << int(rng.integers(8))
            case 1:
                result[at] = int(rng.integers(256))
            case 2:
                del result[at:]
            case 3:
                del result[at : at + int(rng.integers(1, 64))]
            case 4:
                result[at:at] = rng.bytes(int(rng.integers(1, 16)))
            case _:
                end = min(len(result), at + int(rng.integers(1, 32)))
                result[at:end] = bytes(end - at)
    return bytes(result)
