"""``python -m benchmarks`` runs every benchmark; ``python -m benchmarks lp_kernel`` those that are named.

Each module of this folder is one benchmark with a ``main()``; it compares methods in one run on the same inputs.
"""

from __future__ import annotations

import argparse
import sys
from importlib import import_module
from pkgutil import iter_modules

import benchmarks


def main() -> None:
    """Run the benchmarks named on the command line, or all."""
    known = sorted(module.name for module in iter_modules(benchmarks.__path__) if not module.name.startswith("_"))
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Run benchmarks, all by default.")
    parser.add_argument("names", nargs="*", help=f"any of {', '.join(known)}")
    names = parser.parse_args().names or known
    unknown = [name for name in names if name not in known]
    if unknown:
        parser.error(f"no benchmark {unknown[0]!r}; there are {', '.join(known)}")
    for name in names:
        print(f"\n{name}", flush=True)
        sys.argv = [f"benchmarks.{name}"]  # a benchmark's own options keep their defaults
        import_module(f"benchmarks.{name}").main()


main()
