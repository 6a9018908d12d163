"""What programs take for files: python costs.py PROGRAM VALID BOMB..., each a folder with what is given to it.

Every one is read in a process of its own that has read the valid one before: seconds of the processor and kilobytes
beyond what that took, and the answer, as a line of JSON.
"""

from __future__ import annotations

import io
import json
import os
import resource
import sys
from collections.abc import Callable
from contextlib import redirect_stdout
from pathlib import Path
from time import process_time


def checker() -> Callable[[Path], str]:
    from checkers import CHECK

    def run(folder: Path) -> str:
        proof, model, log = (str(folder / name) for name in ("proof.jsonl.gz", "plant.json", "log.csv"))
        sys.argv = ["", proof, "--model", model, "--log", log]
        with redirect_stdout(io.StringIO()) as said:
            CHECK.main()
        return said.getvalue().splitlines()[0]

    return run


def verifier(*words: str) -> Callable[[Path], str]:
    from typer.testing import CliRunner

    from svo.cli import app

    def run(folder: Path) -> str:
        more = [str(folder / word) if "." in word else word for word in words]
        done = CliRunner().invoke(app, ["verify", str(folder / "alarms.jsonl"), *more])
        assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
        return done.output

    return run


PROGRAMS: dict[str, Callable[[], Callable[[Path], str]]] = {
    "checker": checker,
    "plain": lambda: verifier(),
    "log": lambda: verifier("--log", "log.csv"),
    "full": lambda: verifier("--full", "log.csv"),
}


def cost(run: Callable[[Path], str], folder: Path) -> None:
    """Of one folder, in a copy of this process, and said by it."""
    if os.fork():
        os.wait()
        return
    begun, before = process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    answer = run(folder)
    more = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    print(json.dumps([folder.name, process_time() - begun, more, answer]), flush=True)
    os._exit(0)


def main() -> None:
    run = PROGRAMS[sys.argv[1]]()
    for folder in map(Path, sys.argv[2:]):
        if folder.name == "valid":
            print(json.dumps([folder.name, 0.0, 0, run(folder)]), flush=True)
        else:
            cost(run, folder)


if __name__ == "__main__":
    main()
