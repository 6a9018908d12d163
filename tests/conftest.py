"""What all tests share: floats round to nearest, also after pplpy is imported, whose version 0.9 rounds upward."""

import ctypes
from contextlib import suppress

with suppress(ImportError):
    import ppl  # noqa: F401

    ctypes.CDLL(None).fesetround(0)  # FE_TONEAREST
