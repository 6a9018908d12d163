"""Digest of this package's sources, which keys its compiled cache.

Numba keys a cached function by its own file and closure; it does not notice that a function which it calls from
another file has changed, and would go on with the old code.  So only the functions that Python calls are cached, and
each has this digest in its closure.
"""

import hashlib
from pathlib import Path

_FILES = sorted(Path(__file__).parent.glob("[!_]*.py"))  # all but the face of the package
SOURCES = hashlib.sha256(b"".join(p.read_bytes() for p in _FILES)).hexdigest()
