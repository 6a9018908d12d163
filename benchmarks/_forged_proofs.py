"""Proofs of small plants, with their models and logs, that are edited; the independent checker judges them."""

from __future__ import annotations

import csv
import gzip
import io
import json
import re
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from copy import deepcopy
from pathlib import Path
from tempfile import mkdtemp
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks._claims import Truth, anywhere, of_plant, one_reading
from benchmarks._exact_witness import Start, witness
from benchmarks._forged_edits import TEXT, Random, file_of, forged, one_of
from svo import detect, find_plant, read_log, verify
from svo.detection.plant_record import plant_record
from svo.isolation.alarms import write_alarms
from svo.logs.log import Log
from tests.svo.detection.checkers import CHECK
from tests.svo.detection.proof_cases import proven, random_plant, steps_of, tiny
from tests.svo.observers.long_chains import long_chains

EXAMPLES = Path(__file__).parents[1] / "docs" / "examples"
DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def strict_log(content: bytes, columns: Any) -> Any:
    """A log as only one reading of it is possible."""
    text = content.decode("utf-8")
    header, *rows = [row for row in csv.reader(io.StringIO(text, newline=""), strict=True) if row]
    names = [columns["time"], *columns["inputs"], *columns["outputs"]]
    if any(header.count(name) != 1 for name in names) or any(len(row) != len(header) for row in rows):
        raise ValueError("columns")
    for row in rows:
        for cell in (row[header.index(name)] for name in names):
            if cell.strip(" ") not in ("", "nan") and not DECIMAL.fullmatch(cell.strip(" ")):
                raise ValueError("number")
    value = lambda name: np.array([float(row[header.index(name)].strip(" ") or "nan") for row in rows])  # noqa: E731
    u, y = (np.column_stack([value(name) for name in columns[group]]) for group in ("inputs", "outputs"))
    return SimpleNamespace(time=value(columns["time"]), u=np.nan_to_num(u), y=y)  # a missing input may be zero


CELLS = [
    "", "nan", "inf", "1_0", "\uff11", "1e400", " 1.0 ", "0x1p3", "1.0\x0c", "1\u2028", '"1', '"1\n2"', "1;2", "-0.0",
]  # fmt: skip


def edited_log(content: bytes, rng: Random) -> bytes:
    lines = [line.split(",") for line in content.decode().splitlines()]
    i, j = (int(rng.integers(1, len(lines))) for _ in range(2))
    column = int(rng.integers(len(lines[0])))
    match int(rng.integers(9)):
        case 0:
            lines[0][column] = one_of(lines[0], rng)
        case 1:
            lines[i], lines[j] = lines[j], lines[i]
        case 2:
            del lines[i]
        case 3:
            lines.insert(i, lines[j])
        case 4 | 5:
            lines[i][column] = str(one_of(CELLS, rng))
        case 6:
            lines[i].append("7")
        case 7:
            lines[i].pop()
        case _:
            lines[i][column] = repr(float(rng.normal()))
    return ("\n".join(",".join(row) for row in lines) + "\n").encode()


def moved(steps: Sequence[Any], log: bytes, rng: Random) -> tuple[str, list[Any]]:
    """The claim of a proof is about another sample and its time, and so is perhaps the rest of its chain."""
    header, *rows = list(csv.reader(io.StringIO(log.decode())))
    to, steps, by = int(rng.integers(len(rows))), deepcopy(list(steps)), 0
    at = int(rng.choice([i for i, step in enumerate(steps) if step.get("step") == "chain"]))
    by = to - steps[at]["sample"]
    steps[at] |= {"sample": to, "time": float(rows[to][next(i for i, n in enumerate(header) if "time" in n)]).hex()}
    for step in steps[at + 1 :] if rng.random() < 0.7 else []:
        step |= {name: step[name] + by for name in ("sample", "first", "last") if type(step.get(name)) is int}
    return "claim", steps


class Checked:
    """`checker/svo_check.py`: what it prints as proven, given what, of a proof, a model or a log that was edited."""

    def __init__(self, *, only_one: bool = False) -> None:
        self._check, self._truth = CHECK, Truth()
        self._cases: list[tuple[list[Any], bytes, bytes]] = []
        plants: list[tuple[Any, Log]] = [tiny()[:2], random_plant(7), random_plant(2), random_plant(5)]
        for plant, log in plants:
            files = proven(plant, log, Path(mkdtemp(prefix="forgery-")))
            if files is not None:
                self._add(*files)
            if only_one:
                return
        for seed in (7, 2):  # from the first set on, bound by bound
            with long_chains():
                files = proven(*random_plant(seed), Path(mkdtemp(prefix="forgery-")))
            if files is not None:
                self._add(*files)
        cart, log_file = find_plant(str(EXAMPLES / "cart.toml")), EXAMPLES / "cart.csv"
        log, folder = read_log(log_file, cart), Path(mkdtemp(prefix="forgery-"))
        write_alarms(folder / "alarms.jsonl", detect(cart, log, noise="stated").alarms)
        verify(folder / "alarms.jsonl", log, full=True, plant=cart, write_proof=folder / "proof.jsonl.gz")
        (folder / "plant.json").write_text(json.dumps(plant_record(cart, "stated")))
        self._add(folder / "proof.jsonl.gz", folder / "plant.json", log_file)

    def _add(self, proof: Path, plant: Path, log: Path) -> None:
        self._cases.append((steps_of(proof), plant.read_bytes(), log.read_bytes()))

    def __call__(self, rng: Random, folder: Path) -> tuple[str, str]:
        steps, plant, log = one_of(self._cases, rng)
        kind, lines = "", [json.dumps(step) for step in steps]
        chosen = rng.random()
        if chosen < 0.08:
            kind, log = "log", edited_log(log, rng)
        elif chosen < 0.14:
            kind, tree = forged(json.loads(plant), rng, {})
            kind, plant = f"plant, {kind}", json.dumps(tree).encode()
        elif chosen < 0.18:
            kind = str(one_of(sorted(TEXT), rng))
            kind, plant = f"plant, {kind}", TEXT[kind](plant.decode(), rng).encode(errors="surrogatepass")
        elif chosen < 0.26:
            kind, at = str(one_of(sorted(TEXT), rng)), int(rng.integers(len(lines)))
            lines[at] = TEXT[kind](lines[at], rng)
        else:
            kind, edited = moved(steps, log, rng) if rng.random() < 0.1 else self._forged(steps, rng)
            lines = [json.dumps(step) for step in edited]
        behind, content = file_of(lines, rng, is_packed=True)
        paths = [folder / name for name in ("proof.jsonl.gz", "plant.json", "log.csv")]
        for path, part in zip(paths, (content, plant, log), strict=True):
            path.write_bytes(part)
        claims = self._claims(*paths)
        if not claims:
            return behind or kind, "refused"
        why = self._why_false(claims, paths)
        return behind or kind, "still true" if why is None else f"false: {why}"

    @staticmethod
    def _forged(steps: list[Any], rng: Random) -> tuple[str, list[Any]]:
        """Edits of some steps, or of their list."""
        if rng.random() < 0.2:
            return forged(steps, rng, {})
        steps = list(steps)
        at = int(rng.integers(len(steps)))
        if rng.random() < 0.4:
            at = next((i for i in range(at, len(steps)) if steps[i].get("step") in ("alarm", "start", "chain")), at)
        kind, steps[at] = forged(steps[at], rng, {})
        return kind, steps

    def _claims(self, proof: Path, plant: Path, log: Path) -> list[Any]:
        """What the whole program says is proven; none if it refuses."""
        found: list[Any] = []
        inner = self._check.check

        def kept(*given: Any) -> list[Any]:
            found.extend(inner(*given))
            return found

        words = ["svo_check.py", str(proof), "--model", str(plant), "--log", str(log)]
        with (
            patch.object(self._check, "check", kept),
            patch.object(sys, "argv", words),
            redirect_stdout(io.StringIO()) as said,
        ):
            code = self._check.main()
        return found if code == 0 and said.getvalue().count("PROVEN: ") == len(found) else []

    def _why_false(self, claims: list[Any], paths: list[Path]) -> str | None:
        packed, plant, log = (path.read_bytes() for path in paths)
        content = gzip.decompress(packed) if packed[:2] == b"\x1f\x8b" else packed
        if not one_reading(content) or not one_reading(plant.replace(b"\n", b" ")):
            return "two programs read two files"
        model = json.loads(plant)
        try:
            data = strict_log(log, model["columns"])
        except ValueError as error:
            return f"the log has two readings: {error}"
        for observer, sample, chain in claims:
            if self._is_explained((plant, log), model, data, (observer, sample, chain)):
                return f"{observer} explains samples up to {sample}, {chain.premises[0]}"
        return None

    def _is_explained(self, files: tuple[bytes, bytes], model: Any, data: Any, claim: tuple[str, int, Any]) -> bool:
        observer, sample, chain = claim
        record = model["observers"][observer]
        first, (found, premise) = chain.start[0], (chain.start[1], chain.premises[0])
        held = found.rows and [found.rows, *found.ends]
        if "readings alone" in premise or "physical range" in premise:
            start = anywhere(record["n"])
        else:
            rows = [np.array(part, dtype=float) for part in held or [np.zeros((0, record["n"])), [], []]]
            start = Start((np.array(found.box[0]), np.array(found.box[1])), *rows)

        def ask() -> bool:
            instants, delta = of_plant(record, data, first, sample)
            return witness(instants, start, delta)

        key = *map(hash, files), observer, first, sample, str(found.box), str(found.rows), str(found.ends), premise
        return self._truth.explained(key, ask)
