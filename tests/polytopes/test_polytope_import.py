"""Importing the package is light."""

import subprocess
import sys


def test_heavy_libraries_are_not_imported() -> None:
    code = (
        "import sys, polytopes;"
        "heavy = ('cvxpy', 'highspy', 'scipy.spatial', 'matplotlib', 'cdd', 'pandas', 'numba');"
        "print([m for m in heavy if m in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
