"""Run the long checks: ``python -m tests.slow``, or some groups: ``python -m tests.slow soundness polytopes``.

A step that passed on the same files is not run again (``--fresh`` runs all), so a run that was stopped goes on where
it was. Ends with a transcript (group, CPU seconds, cases, failures), kept as `.slow/transcript.md`; exit code 1 if
anything failed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import resource
import subprocess
import sys
from collections import defaultdict
from xml.etree import ElementTree

from tests.slow.groups import ROOT, Step, steps

FOLDER = ROOT / ".slow"
CLOSING = re.compile(r"^(\d+) cases, (\d+) failures$", re.MULTILINE)


def main() -> None:
    planned = list(steps())
    names = list(dict.fromkeys(step.group for step in planned))
    parser = argparse.ArgumentParser(prog="python -m tests.slow", description=__doc__)
    parser.add_argument("groups", nargs="*", help=f"any of {', '.join(names)}; all by default")
    parser.add_argument("--fresh", action="store_true", help="run steps that passed before, too")
    parser.add_argument("--processes", default="2", help="for the tests; 2 by default")
    options = parser.parse_args()
    unknown = set(options.groups) - set(names)
    if unknown:
        parser.error(f"no group {sorted(unknown)[0]!r}; there are {', '.join(names)}")
    FOLDER.mkdir(exist_ok=True)
    results = [run(step, options) for step in planned if not options.groups or step.group in options.groups]
    text = transcript(results)
    (FOLDER / "transcript.md").write_text(text, encoding="utf-8")
    print(text)
    sys.exit(any(result["failures"] for result in results))


def run(step: Step, options: argparse.Namespace) -> dict[str, object]:
    """The result of one step: kept from before, or of a new process."""
    kept = FOLDER / f"{hashlib.sha256(f'{state_of_the_files()} {step}'.encode()).hexdigest()[:16]}.json"
    if kept.exists() and not options.fresh:
        return json.loads(kept.read_text("utf-8"))  # type: ignore[no-any-return]
    print(f"{step.group}: {step}", flush=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    cases, failures = run_tests(step, options.processes) if step.is_pytest else run_command(step)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    result = {"group": step.group, "step": str(step), "seconds": seconds, "cases": cases, "failures": failures}
    if not failures:
        kept.write_text(json.dumps(result), encoding="utf-8")
    return result


def state_of_the_files() -> str:
    """What git says of the files that are there: the commit and everything that differs from it."""
    git = [["git", "rev-parse", "HEAD"], ["git", "diff", "HEAD"], ["git", "status", "--porcelain"]]
    return "".join(subprocess.run(command, cwd=ROOT, capture_output=True, text=True).stdout for command in git)


def run_tests(step: Step, processes: str) -> tuple[int, int]:
    report = FOLDER / "report.xml"
    report.unlink(missing_ok=True)
    pytest = [sys.executable, "-m", "pytest", "-n", processes, "-m", "slow", f"--junitxml={report}"]
    code = subprocess.run([*pytest, *step.arguments], cwd=ROOT).returncode
    if not report.exists():
        return 0, 1
    suite = ElementTree.parse(report).getroot().find("testsuite")
    assert suite is not None
    count = {key: int(suite.get(key, 0)) for key in ("tests", "failures", "errors", "skipped")}
    failures = count["failures"] + count["errors"]
    return count["tests"] - count["skipped"], failures or int(code != 0)


def run_command(step: Step) -> tuple[int, int]:
    done = subprocess.run([sys.executable, "-m", *step.arguments], cwd=ROOT, stdout=subprocess.PIPE, text=True)
    print(done.stdout, flush=True)
    closing = CLOSING.findall(done.stdout)
    if not closing:
        return 0, 1
    return int(closing[-1][0]), int(closing[-1][1]) or int(done.returncode != 0)


def transcript(results: list[dict[str, object]]) -> str:
    total: defaultdict[str, list[float]] = defaultdict(lambda: [0.0, 0, 0])
    for result in results:
        for i, key in enumerate(("seconds", "cases", "failures")):
            total[str(result["group"])][i] += result[key]  # type: ignore[operator]
    rows = [f"| {name} | {row[0]:.0f} | {row[1]:.0f} | {row[2]:.0f} |" for name, row in total.items()]
    failed = [f"\nfailed: {result['step']}" for result in results if result["failures"]]
    return "\n".join(["| group | CPU seconds | cases | failures |", "|---|---|---|---|", *rows, *failed])


if __name__ == "__main__":
    main()
