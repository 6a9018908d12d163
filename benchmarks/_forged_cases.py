"""What is forged, who judges it, and what is true of it: alarms and proofs of small plants."""

from __future__ import annotations

import csv
import gzip
import io
import json
import re
import sys
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks._exact_witness import Instant, Start, witness
from benchmarks._forged_edits import TEXT, Array, Random, file_of, forged, one_of
from svo import detect, find_plant, read_log, verify
from svo.detection.chains import PlantModels
from svo.detection.plant_record import plant_record
from svo.isolation.alarm_record import Alarm, alarm_line, digest_of_record
from svo.isolation.alarms import read_alarms, verify_alarms, write_alarms
from svo.logs.log import Log
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.left_out import channels_of
from tests.svo.detection.checkers import CHECK
from tests.svo.detection.proof_cases import proven, random_plant, steps_of, tiny
from tests.svo.observers.long_chains import long_chains

EXAMPLES = Path(__file__).parents[1] / "docs" / "examples"
DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


# -- what a claim says, as instants ------------------------------------------------------------------------------------


def decoded(record: Any) -> Array:
    """An array of a record, read by nothing of the project."""
    words = record["hex"].split(" ") if record["hex"] else []
    return np.array([float.fromhex(word) for word in words], dtype=float).reshape(record["shape"])


def of_window(
    c: WindowCertificate, model: Sequence[Instant] | None = None
) -> tuple[list[Instant], Start, Array, list[Any]]:
    """What a window's proof claims that nothing explains; with the numbers of ``model`` in the place of its own."""
    instants, n = [], c.n
    for k, s in enumerate(c.samples):
        newest = k == len(c.samples) - 1
        factors = (s.gain, s.functional) if s.gain is not None else channels_of(s.stack, c.owner, c.delta, c.units)
        more: list[tuple[Array, float, float]] = []
        if not newest or c.late:
            before = np.zeros((len(c.w_rows), s.stack.shape[2] - c.w_rows.shape[1]))
            more += list(zip(np.hstack([before, c.w_rows]), c.w_rows_lower, c.w_rows_upper, strict=True))
        for q, (gain, functional) in enumerate(zip(*(factors or ([], [])), strict=True)):
            unused = newest and not ((c.late and gain[n:].any()) or s.s_lower[q] or s.s_upper[q])
            if not unused and (functional[:n].any() or functional[n + len(s.u) + 1 :].any()):
                more.append((functional, s.s_lower[q], s.s_upper[q]))
        added = s.slack + (0.0 if s.remainder is None else s.remainder)
        own = Instant(s.stack, s.u, s.y, s.noise, s.w_lower, s.w_upper) if model is None else model[k]
        y = np.where(np.isnan(s.y), np.nan, own.y)
        width = np.where(added > 0.0, np.nextafter(own.width + added, 0.0), own.width)
        instants.append(replace(own, y=y, width=width, more=[*own.more, *more], sums_width=added))
    items = range(1, len(c.samples[0].stack))
    mine = [c.delta[c.owner == item] for item in items]
    delta = np.array([(d[:, 0].max(), d[:, 1].min()) if len(d) else (0.0, 0.0) for d in mine]).reshape(-1, 2)
    sums = [] if c.sums is None else [
        (int(j), int(a) - c.first, int(b) - c.first, low, high)
        for j, a, b, low, high in zip(c.sums.column, c.sums.first, c.sums.last, c.sums.lower, c.sums.upper, strict=True)
    ]  # fmt: skip
    a = c.arrival
    return instants, Start((a.box_lower, a.box_upper), a.rows, a.lower, a.upper), delta, sums


def of_plant(record: Any, log: Any, first: int, last: int) -> tuple[list[Instant], Array]:
    """An observer's model in plant.json over samples of a log, and its bounds of Delta."""
    matrices = record["matrices"]
    stacks, n, nu = decoded(matrices["stacks"]), record["n"], record["inputs"]
    schedule = decoded(matrices["schedule"]) if "schedule" in matrices else None

    def stack(k: int) -> Array:
        if schedule is None:
            return stacks[k if len(stacks) > 1 else 0]
        points, s = decoded(matrices["points"]), schedule[k]
        if s <= points[0] or s >= points[-1]:
            return stacks[0 if s <= points[0] else -1]
        i = int(np.flatnonzero(points <= s)[-1])
        return (stacks[i + 1] - stacks[i]) / (points[i + 1] - points[i]) * (s - points[i]) + stacks[i]

    def at(name: str, k: int) -> Array:
        rows = decoded(record[name])
        return rows[k if len(rows) > 1 else 0]

    more = []
    rows = record["w_rows"]
    for row, low, high in zip(*(decoded(rows[key]) for key in ("rows", "lower", "upper")), strict=True):
        more.append((np.concatenate([np.zeros(n + nu + 1), row]), low, high))
    if record["physical"] is not None:
        axes = np.eye(n, n + nu + 1 + record["disturbances"])
        more += list(zip(axes, *map(decoded, record["physical"]), strict=True))
    instants = [
        Instant(stack(k), log.u[k], log.y[k], at("noise", k), at("w_lower", k), at("w_upper", k), more)
        for k in range(first, last + 1)
    ]
    return instants, decoded(record["delta"])


def set_of(record: Any) -> Start:
    return Start(
        (decoded(record["box_lower"]), decoded(record["box_upper"])),
        *(decoded(record[key]) for key in ("rows", "lower", "upper")),
    )


def anywhere(n: int) -> Start:
    return Start((np.full(n, -np.inf), np.full(n, np.inf)), np.zeros((0, n)), np.zeros(0), np.zeros(0))


class Truth:
    """Remembers what has been asked."""

    def __init__(self) -> None:
        self._known: dict[Any, bool] = {}

    def explained(self, key: Any, ask: Callable[[], bool]) -> bool:
        if key not in self._known:
            self._known[key] = ask()
        return self._known[key]


def one_reading(text: bytes) -> bool:
    """Whether every parser reads the same: ASCII, no entry twice, no number that JSON does not have."""

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len({key for key, _ in pairs}) != len(pairs):
            raise ValueError("twice")
        return dict(pairs)

    def none(word: str) -> Any:
        raise ValueError(word)

    try:
        for line in text.split(b"\n"):
            if line.strip():
                json.loads(line.decode("ascii"), object_pairs_hook=once, parse_constant=none)
    except ValueError:
        return False
    return True


# -- records -----------------------------------------------------------------------------------------------------------


def with_sums(record: Any, rng: Random) -> None:
    """Bounds of sums, over anything."""
    c = record["certificate"]
    if not isinstance(c, dict) or not isinstance(c.get("samples"), list):
        return
    count, r = len(c["samples"]), int(rng.integers(1, 3))
    numbers = lambda values: {"shape": [r], "hex": " ".join(float(v).hex() if v else "0" for v in values)}  # noqa: E731
    ends = rng.integers(-1, count + 1, (2, r)) + (c["first"] if isinstance(c.get("first"), int) else 0)
    half = np.abs(rng.normal(size=r)) * rng.choice([1e-3, 1.0, 10.0])
    c["sums"] = {
        "column": rng.integers(-1, 4, r).tolist(), "first": ends[0].tolist(), "last": ends[1].tolist(),
        "lower": numbers(-half), "upper": numbers(half), "on_sum": numbers(rng.normal(size=r)),
    }  # fmt: skip


def certain(record: Any, rng: Random) -> None:
    """What would prove anything: no noise, no output, no disturbance, no way for the state to be where it is."""
    c = record["certificate"]
    name = str(rng.choice(["noise", "w_lower", "w_upper", "y", "slack", "remainder", "stacks", "box_upper", "lines"]))
    value = float(rng.choice([0.0, -1.0, 1e-300, 1.0]))

    def change(part: Any) -> None:
        if isinstance(part, dict):
            for key, entry in part.items():
                if key == name and isinstance(entry, dict) and isinstance(entry.get("hex"), str) and entry["hex"]:
                    entry["hex"] = " ".join([value.hex() if value else "0"] * (entry["hex"].count(" ") + 1))
                else:
                    change(entry)
        elif isinstance(part, list):
            for entry in part:
                change(entry)

    change(c)
    change(record.get("matrices"))


MORE = {"sums": with_sums, "certain": certain}


class Records:
    """Alarms of a cart, two tanks and a scheduled plant, each edited and verified."""

    def __init__(self) -> None:
        self._cases: list[tuple[Any, Log, list[Any]]] = []
        for name in ("cart", "two_tanks"):
            plant = find_plant(str(EXAMPLES / f"{name}.toml"))
            self._add(plant, read_log(EXAMPLES / f"{name}.csv", plant))
        for seed in (7, 2):
            plant, log = random_plant(seed)
            self._add(plant, Log(log.time, log.u, log.y))
        self._truth = Truth()

    def _add(self, plant: Any, log: Log) -> None:
        found = detect(plant, log, noise="stated").alarms
        self._cases.append((plant, log, [json.loads(alarm_line(alarm)) for alarm in found]))

    def _file(self, rng: Random, folder: Path) -> tuple[str, Path, Any, Log]:
        plant, log, records = one_of([case for case in self._cases if case[2] and self._takes(case[0])], rng)
        kind, record = forged(one_of(records, rng), rng, MORE)
        line = json.dumps(
            record | {"sha256": digest_of_record(record)} if isinstance(record, dict) else record, sort_keys=True
        )
        if rng.random() < 0.15:
            kind = str(one_of(sorted(TEXT), rng))
            line = TEXT[kind](line, rng)
        behind, content = file_of([line], rng, is_packed=False)
        path = folder / "alarms.jsonl"
        path.write_bytes(content)
        return behind or kind, path, plant, log

    def _takes(self, plant: Any) -> bool:
        return True

    def _said(self, path: Path, log: Log, plant: Any) -> bool:
        raise NotImplementedError

    def _is_false(self, alarm: Alarm, log: Log, plant: Any) -> str | None:
        raise NotImplementedError

    def __call__(self, rng: Random, folder: Path) -> tuple[str, str]:
        kind, path, plant, log = self._file(rng, folder)
        try:
            accepted = self._said(path, log, plant)
        except (ValueError, OSError):
            accepted = False
        if not accepted:
            return kind, "refused"
        if not one_reading(path.read_bytes()):
            return kind, "false: two programs read two files"
        for alarm in read_alarms(path):
            if (why := self._is_false(alarm, log, plant)) is not None:
                return kind, f"false: {why}"
        return kind, "still true"


class Plain(Records):
    """``svo verify``: the claim is about the record's own numbers."""

    def _said(self, path: Path, log: Log, plant: Any) -> bool:
        return any(check.ok for check in verify_alarms(path))

    def _is_false(self, alarm: Alarm, log: Log, plant: Any) -> str | None:
        c = alarm.certificate
        assert isinstance(c, WindowCertificate)
        return "explained by its own numbers" if witness(*of_window(c)) else None


class WithLog(Records):
    """``svo verify --log``: the numbers are the plant's, in the log; of linearisations, the record's own."""

    def _said(self, path: Path, log: Log, plant: Any) -> bool:
        return all(check.ok for check in verify_alarms(path, log, PlantModels(plant, log).difference))

    def _is_false(self, alarm: Alarm, log: Log, plant: Any) -> str | None:
        c = alarm.certificate
        assert isinstance(c, WindowCertificate)
        if log.time[alarm.sample] != alarm.time:
            return "another time"
        first = alarm.sample + 1 - len(c.samples)
        models = plant_record(plant, "stated", log)["observers"]
        if alarm.observer not in models:
            return "no such observer"
        if "matrices" not in models[alarm.observer]:
            used = [~np.isnan(s.y) for s in c.samples]
            if any(
                not (s.y[at] == log.y[first + k][at]).all()
                for k, (s, at) in enumerate(zip(c.samples, used, strict=True))
            ):
                return "other readings"
            return "explained by its own numbers" if witness(*of_window(c)) else None
        instants, delta = of_plant(models[alarm.observer], log, first, alarm.sample)
        if not c.late:
            instants[-1] = replace(
                instants[-1], more=[m for m in instants[-1].more if not m[0][len(m[0]) - c.w_rows.shape[1] :].any()]
            )
        claim = of_window(c, instants)
        return "explained by the plant" if witness(claim[0], claim[1], delta) else None


class Full(Records):
    """``svo verify --full``: a trajectory from the first set explains the log up to the alarm, or none does."""

    def _takes(self, plant: Any) -> bool:
        return "two_tanks" not in str(plant.name)

    def _said(self, path: Path, log: Log, plant: Any) -> bool:
        return verify(path, log, full=True, plant=plant).ok

    def _is_false(self, alarm: Alarm, log: Log, plant: Any) -> str | None:
        if log.time[alarm.sample] != alarm.time:
            return "another time"
        models = plant_record(plant, "stated", log)["observers"]
        if alarm.observer not in models:
            return "no such observer"

        def ask() -> bool:
            instants, delta = of_plant(models[alarm.observer], log, 0, alarm.sample)
            return witness(instants, set_of(models[alarm.observer]["first"]), delta)

        explained = self._truth.explained((str(plant.name), len(log), alarm.observer, alarm.sample), ask)
        return "explained from the first sample on" if explained else None


# -- proofs ------------------------------------------------------------------------------------------------------------


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


TARGETS: dict[str, Callable[[], Callable[[Random, Path], tuple[str, str]]]] = {
    "plain": Plain,
    "log": WithLog,
    "full": Full,
    "checker": Checked,
}
