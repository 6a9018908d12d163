#!/usr/bin/env python3
"""Check a proof that no run of a plant's model gives a log: `docs/proof_format.md`, with the standard library alone.

    python svo_check.py proof.jsonl.gz --model plant.json --log log.csv

Numbers are integers times a power of two, so that nothing is rounded but, outward, what the factors of a channel leave
out. Nothing is solved: the proof has the multipliers. Exit code 0: every chain is proven; 1: a step does not follow.
"""

import argparse
import csv
import gzip
import hashlib
import io
import json
import math
import re
import sys
import time
from collections import defaultdict
from itertools import pairwise, product, zip_longest
from pathlib import Path

FLOAT = re.compile(r"(?:-?0x[01](?:\.[0-9a-f]{1,13})?p[+-][0-9]{1,4}|0|nan|-?inf)")
FLOATS = re.compile(rf"(?:{FLOAT.pattern}(?: {FLOAT.pattern})*+)?")
DECIMAL = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
MOST_UNPACKED, MOST_TIMES, MOST_SIZE = 1 << 19, 50, 1 << 10  # bytes; times the file's; states, inputs, ...
LONGEST = 1 << (1 << 18)  # of a window's integers
STARTS = {
    "first": "the first set of the model holds the state at sample 0",
    "readings": "the model holds from sample {0} on, where the readings alone say where the state is",
    "physical": "the model holds from sample {0} on, where the state is in its physical range",
    "largest": "the largest set holds the state at sample {0}, where it started again",
    "assumed": "the state is in a set that is ASSUMED at sample {0} (left by others' models): {1}",
}
READ_WITHIN = 1.125  # times the size of a box that readings prove: where they look for it
REFUSALS = Exception  # whatever goes wrong, nothing is proven
TOLERANCE = 0.0100000001  # of the sampling time, by which the times of a log may differ from it
Wrong = type("Wrong", (ValueError,), {})


def expect(holds, why):
    if not holds:
        raise Wrong(why)


class Vec:  # integers times 2^e; a number is a vector of one, and multiplies vectors
    def __init__(self, m, e=0):
        self.m, self.e = m, e

    @classmethod
    def of(cls, values):
        expect(all(map(math.isfinite, values)), "a number is not finite")
        pairs = [(top, 1 - bottom.bit_length()) for top, bottom in (v.as_integer_ratio() for v in values)]
        e = min((p for m, p in pairs if m), default=0)
        return cls([m << (p - e) if m else 0 for m, p in pairs], e)

    def __add__(self, other):
        e = min(self.e, other.e)
        a, b = self.e - e, other.e - e
        return Vec([(x << a) + (y << b) for x, y in zip(self.m, other.m, strict=True)], e)

    def __sub__(self, other):
        return self + num(-1.0) * other

    def __mul__(self, other):
        return Vec([self.m[0] * x for x in other.m], self.e + other.e)

    def __lt__(self, other):
        return (self - other).m[0] < 0

    def __getitem__(self, part):
        return Vec(self.m[part], self.e)


def num(value):
    return Vec.of([value])


def up(value):
    return math.nextafter(value, math.inf)


def real(text):
    expect(FLOAT.fullmatch(text), f"expected a float in hexadecimal, found {text[:40]!r}")
    return float.fromhex(text)


def array(record, *shape):  # a nested list of floats; a None in the shape is any length
    found, words = record["shape"], record["hex"]
    fits = (type(n) is int and n >= 0 and want in (None, n) for n, want in zip_longest(found, shape, fillvalue=""))
    expect(len(record) == 2 and all(fits), f"an array has shape {str(found)[:80]}; expected {list(shape)}")
    expect(FLOATS.fullmatch(words), f"expected floats in hexadecimal, found {words[:40]!r}")
    values = [*map(float.fromhex, words.split(" "))] if words else []
    expect(math.prod(found) == len(values) and found[0] <= max(len(values), 1 << 16), "an array has other entries")
    for n in reversed(found[1:]):
        values = [values[i : i + n] for i in range(0, len(values), n)] if n else [[] for _ in range(found[0])]
    return values


def count(value, least=0, end=2**53):
    expect(type(value) is int and least <= value < end, f"expected an integer from {least} to below {end}")
    return value


def lines_of(path):  # of a file, packed or not, those that are not blank
    most = max(MOST_UNPACKED, MOST_TIMES * len(content := Path(path).read_bytes()))
    if content[:2] == b"\x1f\x8b":
        expect(content.count(b"\x1f\x8b\x08") < 1000 + len(content) // 48, "its gzip members hold nothing")
        content = gzip.GzipFile(fileobj=io.BytesIO(content)).read(most + 1)
    expect(len(content) <= most, f"it unpacks to more than {most >> 10} kB")
    return (line for line in io.BytesIO(content) if line.strip())


def parsed(text):  # JSON that no two programs read differently
    def once(pairs):
        expect(len(dict(pairs)) == len(pairs), "an entry stands twice in an object")
        return dict(pairs)

    return json.loads(text.decode("ascii"), object_pairs_hook=once, parse_constant=real)


def cell(text):
    missing = text.strip(" ").lower() in ("", "nan")
    expect(missing or DECIMAL.fullmatch(text.strip(" ")), f"expected a decimal in the log, found {text[:40]!r}")
    return math.nan if missing else float(text)


class Log:
    def __init__(self, path, columns):
        text = Path(path).read_text(encoding="utf-8-sig")
        whole = io.StringIO(text[: text.rfind("\n") + 1], newline="")  # a line without its end is no sample
        header, *rows = [row for row in csv.reader(whole, strict=True, skipinitialspace=True) if row] or [[]]
        groups = [[columns["time"]], columns["inputs"], columns["outputs"]]
        expect(all(header.count(name) == 1 for g in groups for name in g), f"expected one column each of {groups}")
        expect({*map(len, rows)} <= {len(header)}, "a row of the log has other cells than its header")
        table = [[[cell(row[header.index(c)]) for c in group] for group in groups] for row in rows]
        self.time, self.u, self.y = [t for (t,), _, _ in table], [u for _, u, _ in table], [y for _, _, y in table]

    def check_times(self, last, Ts, intervals):
        for k in range(last):
            dt, wanted = self.time[k + 1] - self.time[k], intervals[k] if intervals else Ts
            near = dt == wanted if intervals else abs(dt - Ts) <= TOLERANCE * Ts
            expect(near and dt > 0.0, f"samples {k} and {k + 1} are {dt:g} s apart, not {wanted:g}")


class Set:  # {x : box[0] <= x <= box[1], ends[0] <= rows x <= ends[1]}
    def __init__(self, box, rows=(), ends=((), ())):
        self.box, self.rows, self.ends = box, rows, ends

    @classmethod
    def read(cls, record, n, box=None):
        rows = array(record["rows"], None, n)
        ends = [array(record[end], len(rows)) for end in ("lower", "upper")]
        return cls(box or [array(record[end], n) for end in ("box_lower", "box_upper")], rows, ends)

    def within(self, other):
        (low, high), (least, most) = self.box, other.box
        return Set([[*map(max, low, least)], [*map(min, high, most)]], self.rows, self.ends)

    def least(self, g, multipliers=()):  # of g x, less the multiplied rows
        total = num(0.0)
        for m, row, *ends in zip(multipliers or [0.0] * len(self.rows), self.rows, *self.ends, strict=True):
            if m:
                total -= num(m) * num(ends[m > 0])
                g += num(m) * Vec.of(row)
        box = [*enumerate(zip(g.m, *self.box, strict=True))]  # an end that is not there is no finite number
        return sum((g[i : i + 1] * num(ends[x < 0]) for i, (x, *ends) in box if x), total)

    def expect_point(self, what):  # each row looked at alone; of what is empty a proof says nothing
        pairs = [pair for both in (self.box, self.ends) for pair in zip(*both, strict=True)]
        holds = all(low <= high and low < math.inf and high > -math.inf for low, high in pairs)
        for row, *ends in zip(self.rows, *self.ends, strict=True):
            for side, end in zip((-1.0, 1.0), ends, strict=True):
                at = [self.box[side * v < 0][j] for j, v in enumerate(row) if v]
                if holds and all(map(math.isfinite, (end, *at))):
                    holds = not num(side * end) < Set(self.box).least(Vec.of([side * v for v in row]))
        expect(holds, f"nothing is within {what}; expected lower bounds up to upper ones, and rows that meet these")


class Model:  # an observer's: the numbers of plant.json alone, never those of a proof
    def __init__(self, record):
        keys = "n", "inputs", "outputs", "disturbances"
        n, nu, ny, nw = (count(record[key], key in ("n", "outputs"), MOST_SIZE) for key in keys)
        self.n, self.nu, self.ny, self.rows, self.columns = n, nu, ny, n + ny, n + nu + 1 + nw
        self.delta = array(record["delta"], None, 2)
        given = record["matrices"]
        self._points, self._schedule = (array(given[p], None) if p in given else None for p in ("points", "schedule"))
        self._stacks = array(given["stacks"], None, 1 + len(self.delta), self.rows, self.columns)
        points = self._points or range(len(self._stacks))
        expect(len(points) == len(self._stacks) and all(a < b for a, b in pairwise(points)), "points are out of order")
        self._bounds = [array(record[b], None, size) for b, size in (("noise", ny), ("w_lower", nw), ("w_upper", nw))]
        sums = record.get("sums", [])
        self._remainder = array(record["remainder"], None, ny) if "remainder" in record else [[0.0] * ny]
        self.sums = [(count(s["column"], 0, ny + nw), count(s["samples"], 1), *array(s["ends"], 2)) for s in sums]
        self.w_set = Set.read(record["w_rows"], nw, [[-math.inf] * nw, [math.inf] * nw])
        self.first = Set.read(record["first"], n)
        ranges = (record["physical"], record["largest"])
        self.physical, self.largest = (None if r is None else Set([array(end, n) for end in r]) for r in ranges)
        self.always = self.physical or Set([[-math.inf] * n, [math.inf] * n])
        self._expect_points()
        self._known, self.is_scheduled = {}, self._points is not None or len(self._stacks) > 1
        self.premises = ["the state never leaves the physical range of the model"] * (self.physical is not None)
        self.premises += ["the model file has the right matrices of each sample: an AXIOM"] * self.is_scheduled

    def _expect_points(self):
        for k in range(max(map(len, (*self._bounds, self._remainder)))):
            noise, low, high, remainder = Model.bounds(self, k)
            Set([[0.0] * 2 * self.ny, noise + remainder]).expect_point("the noise")
            Set([low, high], self.w_set.rows, self.w_set.ends).expect_point("the bounds of w")
        noise, low, high = (list(map(f, *b, b[0])) for f, b in zip((max, min, max), self._bounds, strict=True))
        for j, length, *ends in self.sums:
            reach = [[each[j]] for each in ([-v for v in noise] + low, noise + high)]
            Set(reach, [[float(length)]], [[end] for end in ends]).expect_point("the ends of a sum")
        Set([*zip(*self.delta, strict=True)] or ((), ())).expect_point("the bounds of Delta")
        for of in (self.always, self.first, self.largest or self.always):
            of.within(self.always).expect_point("a set of the state")

    def bounds(self, k):  # noise, lower and upper w, and remainder of the output of a sample
        return [each[0 if len(each) == 1 else k] for each in (*self._bounds, self._remainder)]

    def stack(self, k, vertex=()):  # items of rows of floats; the first one, its states' rows at a Delta, as integers
        k, at = (k if self.is_scheduled else 0), (k * self.is_scheduled, vertex)
        if at not in self._known:
            floats = self._stacks[0 if len(self._stacks) == 1 else k] if self._points is None else self._at(k)
            flat = Vec.of([v for row in floats[0] for v in row])
            for delta, item in zip(vertex, floats[1:] if vertex else (), strict=True):
                flat += num(delta) * Vec.of([v * (i < self.n) for i, row in enumerate(item) for v in row])
            rows = [flat.m[i : i + self.columns] for i in range(0, len(flat.m), self.columns)]
            self._known[at] = floats, rows, flat.e
        return self._known[at]

    def _at(self, k):  # linear interpolation, five operations in doubles; the nearest end beyond the points
        points, s = self._points, self._schedule[k]
        if s <= points[0] or s >= points[-1]:
            return self._stacks[0 if s <= points[0] else -1]
        i = max(j for j in range(len(points)) if points[j] <= s)
        step, beyond = points[i + 1] - points[i], s - points[i]
        pairs = [zip(*items, strict=True) for items in zip(self._stacks[i], self._stacks[i + 1], strict=True)]
        return [[[(b - a) / step * beyond + a for a, b in zip(*rows, strict=True)] for rows in item] for item in pairs]


class Chain:  # what follows, step by step, about one observer's model
    def __init__(self, model, log, claimed):
        self.model, self.log, self.claimed, self.start, self.directions, self.checked = model, log, claimed, None, {}, 0
        self.bounds, self.channels, self.premises = {}, {}, []
        self._sample = lambda value: count(value, 0, claimed + 1)  # nothing after it is used

    def take(self, step):
        kind = step["step"]
        if kind in ("start", "channels"):
            self._start(step) if kind == "start" else self._choose(self._sample(step["sample"]), step)
        elif kind in ("s", "x"):
            k, side, value = self._sample(step["sample"]), {"upper": 1, "lower": -1}[step["side"]], real(step["value"])
            which = count(step["channel" if kind == "s" else "row"])
            self._bounded(step, value, k, (self.channels[k][2] if kind == "s" else self.directions[k])[which], side)
            (self.channels[k][4] if kind == "s" else self.bounds)[k, which, side] = value
        elif kind == "directions":  # of one sample, in the place of the template
            self.directions[k := self._sample(step["sample"])][self.model.n :] = array(step["rows"], None, self.model.n)
            self.bounds = {at: value for at, value in self.bounds.items() if at[0] != k}
        else:
            expect(kind == "alarm", "no step of a known kind")
            expect(all(total.m[0] > 0 for total in self._cases(step)), "the multipliers do not prove an empty window")
        self.checked += 1

    def _start(self, step):  # everything before is forgotten
        k, kind, model = self._sample(step["sample"]), step["from"], self.model
        expect(kind in STARTS and (k == 0 or kind != "first"), "no known start, or a first set after sample 0")
        axes = [[float(i == j) for j in range(model.n)] for i in range(model.n)]
        template = array(step["template"], None, model.n)
        self.bounds, self.channels, self.directions = {}, {}, defaultdict(lambda: axes + template)
        found = self._read(step, k) if kind == "readings" else getattr(model, kind, None)
        if kind == "assumed":
            (found := Set.read(step["set"], model.n)).within(model.always).expect_point("the set that is assumed")
        expect(found is not None, f"the model has no {kind} set")
        self.start = k, found.within(model.always)
        box = ", ".join(f"{low:.6g} to {high:.6g}" for low, high in zip(*found.box, strict=True))
        rows = zip(found.rows, *found.ends, strict=True)
        box += "".join(f"; {row} x: {low:.6g} to {high:.6g}" for row, low, high in rows)
        self.premises = [STARTS[kind].format(k, box), *model.premises]

    def _read(self, step, k):  # wherever x is: |x| <= t X, t > 1, implies |x| < t X, and |x| <= X the box
        box = [array(step[end], self.model.n) for end in ("lower", "upper")]
        wide = [up(READ_WITHIN * size) for size in largest(*box)]
        self.start = k, Set([[-v for v in wide], wide])
        for i, rows in enumerate(array(step["inverse"], self.model.n, None, self.model.ny)):
            window = {"first": k, "last": k + len(rows) - 1, "on_start": {"shape": [0], "hex": ""}}
            for end, side in zip(box, (-1, 1), strict=True):
                self._bounded(window, end[i], k, self.directions[k][i], side, [[side * m for m in row] for row in rows])
        return Set(box)

    def _set(self, k):  # what is proven of the state at a sample; infinite ends where nothing is
        expect(self.start is not None and k >= self.start[0], "a step is about samples before its set starts")
        if k == self.start[0]:
            return self.start[1]
        n, rows = self.model.n, self.directions[k]
        ends = [[self.bounds.get((k, row, side), side * math.inf) for row in range(len(rows))] for side in (-1, 1)]
        return Set([e[:n] for e in ends], rows[n:], [e[n:] for e in ends]).within(self.model.always)

    def _choose(self, k, step=None):  # factors, if any, and what they leave out, by entries, rounded up
        model, found = self.model, {}
        owner = [count(i, 1, 1 + len(model.delta)) for i in (step["owner"] if step else ())]
        sizes = (("gain", model.rows), ("functional", model.columns))
        gain, functional = (array(step[name], len(owner), size) if step else () for name, size in sizes)
        for item, ends in enumerate(model.delta, start=1):
            for i, row in enumerate(model.stack(k)[0][item]):
                rest = Vec.of(row)
                for q in (q for q, of in enumerate(owner) if of == item and gain[q][i]):
                    rest -= num(gain[q][i]) * Vec.of(functional[q])
                for j in (j for j, m in enumerate(rest.m) if m):
                    size = up(abs(rest.m[j] << max(rest.e, 0)) / (1 << max(-rest.e, 0)))
                    found[i, j] = up(found.get((i, j), 0.0) + up(size * max(map(abs, ends))))
        self.channels[k] = owner, gain, functional, found, {}  # and bounds of s: of others' none are known
        return self.channels[k]

    def _bounded(self, step, value, k, direction, side, on_output=None):  # direction'(x, u, 1, w) at a sample, by value
        whole = [side * v for v in direction] + [0.0] * (self.model.columns - len(direction))
        totals = self._cases(step, k, Vec.of(whole), on_output)
        expect(all((total + num(side * value)).m[0] >= 0 for total in totals), f"a bound of sample {k} is not proven")

    def _cases(self, step, *of, vertex=()):  # totals: of both signs of an s; of Delta's vertices before a sample
        if "split" in step:
            (k, q), kept = step["split"], self.channels
            for side, case in zip((1, -1), step["cases"], strict=True):
                self.channels = kept | {k: (*kept[k][:4], kept[k][4] | {(k, q, side): 0.0})}
                yield from self._cases(case, *of, vertex=vertex)
            self.channels = kept
        elif "vertices" in step:
            moved = [any(map(any, item[: self.model.n])) for item in self.model.stack(of[0] - 1)[0][1:]]
            deltas = product(*(ends[: 1 + m] for ends, m in zip(self.model.delta, moved, strict=True)))
            for vertex, case in zip(deltas, step["vertices"], strict=True):
                yield from self._cases(case, *of, vertex=vertex)
        else:
            yield self._total(step, *of, vertex=vertex)

    def _total(self, step, at=None, objective=None, on_output=None, vertex=()):  # least of rows, bounds, objective
        model, n, nu = self.model, self.model.n, self.model.nu
        first, last = self._sample(step["first"]), self._sample(step["last"])
        length = last - first + 1
        expect(length > 0 and (at is None or first <= at <= last), "a window's samples are out of order")
        on_output, lines = on_output or array(step["on_output"], length, model.ny), self._lines(step, length)
        on_w = array(step["on_w"], length, len(model.w_set.rows)) if "on_w" in step else [()] * length
        known, reach, costate = self._set(first), None, Vec([0] * n)
        total, summed = self._sums(step, first, last)
        for i in range(length - 1, -1, -1):
            k = first + i
            _, rows, e = model.stack(k, corner := vertex * (k + 1 == at))
            expect(all(abs(m) < LONGEST for m in costate.m), "a window's numbers are too long")
            noise, low, high, remainder = model.bounds(k)
            for m, y, *widths in (r for r in zip(on_output[i], self.log.y[k], noise, remainder, strict=True) if r[0]):
                total -= num(m) * num(y) + num(abs(m)) * (num(widths[0]) + num(widths[1]))  # y: no number if not read
            more = summed.get(k, Vec([0] * (model.rows + model.columns)))
            weight = Vec(costate.m + [0] * model.ny, costate.e) + Vec.of([0.0] * n + on_output[i]) + more[: model.rows]
            used = [(w, row) for w, row in zip(weight.m, rows, strict=True) if w]
            sums = [sum(w * row[j] for w, row in used) for j in range(model.columns)]
            g = Vec(sums, weight.e + e) + more[model.rows :] - (objective if at == k else Vec([0] * model.columns))
            owner, gain, functional, rest, _ = self.channels.get(k) or self._choose(k)
            free = Vec([0] * n + weight.m[n:], weight.e) if corner else weight  # of the rows that Delta still moves
            for q in range(len(owner)):
                on_p = Set([gain[q]] * 2).least(free)
                for side, m, slope, intercept in lines.pop((i, q), ()):
                    # max Delta s is convex in s, and min Delta s concave: a line bounds them if it does at both ends
                    ends = product(*self._ends(k, q))
                    gaps = [num(slope) * num(s) + num(intercept) - num(d) * num(s) for d, s in ends]
                    expect(all(side * gap.m[0] >= 0 for gap in gaps), f"a line of sample {k} does not bound its p")
                    on_p += num(side * m)
                    g -= num(side * m) * num(slope) * Vec.of(functional[q])
                    total -= num(side * m) * num(intercept)
                if on_p.m[0]:
                    total += min(on_p * num(d) * num(s) for d, s in product(*self._ends(k, q)))
            for row, column in (entry for entry in rest if free.m[entry[0]]):
                reach = reach or self._reach(known, first, last)
                total -= Vec([abs(free.m[row])], free.e) * num(up(rest[row, column] * reach[i][column]))
            total += Set([self.log.u[k]] * 2).least(g[n : n + nu]) + g[n + nu : n + nu + 1]
            total += model.w_set.within(Set([low, high])).least(g[n + nu + 1 :], on_w[i])
            costate = g[:n]
            same = not vertex or k != at or not any((costate + objective[:n]).m)
            expect(same, "multipliers after a transition at the vertices of Delta differ from vertex to vertex")
        expect(not lines, "a line is of a channel that there is not")
        return total + known.least(costate, array(step["on_start"], len(known.rows)))

    def _sums(self, step, first, last):  # what bounds of sums come to; by sample multipliers of rows, then of z
        total, found, model = num(0.0), {}, self.model
        sums = array(step["sum"], None, 1) if "sum" in step else []
        for (row, end), (m,) in zip(step.get("on_sum", []), sums, strict=True):
            column, length, *ends = model.sums[count(row)]
            expect(first + length - 1 <= count(end) <= last, "a sum is not within its window")
            total -= num(m) * num(ends[m > 0] if column >= model.ny else -ends[m < 0])  # a row of outputs is of -v
            for k in range(end + 1 - length, end + 1):
                noise, _, _, remainder = model.bounds(k)
                if column < model.ny and math.isnan(self.log.y[k][column]):  # at most the noise
                    total -= num(abs(m)) * num(noise[column])
                    continue
                if column < model.ny:
                    total -= num(m) * num(self.log.y[k][column]) + num(abs(m)) * num(remainder[column])
                at = model.n + column + (column >= model.ny) * (model.n + model.nu + 1)  # of rows and z = (x, u, 1, w)
                one = num(m) * Vec([int(j == at) for j in range(model.rows + model.columns)])
                found[k] = found[k] + one if k in found else one
        return total, found

    def _lines(self, step, length):  # by index in the window and channel: side (1 above), multiplier, slope, intercept
        found = {}
        lines = array(step["line"], None, 3) if "line" in step else []
        for (i, q, side), (m, *line) in zip(step.get("on_line", []), lines, strict=True):
            expect(count(i) < length and count(side) < 2 and m >= 0.0, "a multiplier of a line is none")
            found.setdefault((i, count(q)), []).append((1 - 2 * side, m, *line))
        return found

    def _ends(self, k, q):  # of Delta, and of s
        s = [self.channels[k][4].get((k, q, side)) for side in (-1, 1)]
        expect(None not in s, f"s of a channel of sample {k} has no proven bounds")
        return self.model.delta[self.channels[k][0][q] - 1], s

    def _reach(self, known, first, last):  # bounds of |x|, |u|, 1, |w| at each sample, in floats rounded up
        found, x, deltas = [], largest(*known.box), largest(*zip(*self.model.delta, strict=True))
        for k in range(first, last + 1):
            found.append(z := [*x, *map(abs, self.log.u[k]), 1.0, *largest(*self.model.bounds(k)[1:3])])
            items = [*zip([1.0, *deltas], self.model.stack(k)[0], strict=True)]
            rows = [[(d, *ab) for d, item in items for ab in zip(item[i], z, strict=True)] for i in range(self.model.n)]
            x = [up(math.fsum(up(up(d * abs(a)) * b) for d, a, b in row if a)) for row in rows]
        return found


def largest(low, high):
    return [max(abs(a), abs(b)) for a, b in zip(low, high, strict=True)]


def chain_of(plant, observer, log, sample):  # of a nonlinear model by the file beside this one
    try:
        record = plant["observers"][observer]
        if "equations" not in record:
            return Chain(Model(record), log, sample)
        sys.modules.setdefault("svo_check", sys.modules[__name__])
        sys.path.append(str(Path(__file__).parent))
        return __import__("svo_check_nonlinear").Linearised(record, plant, log, sample)
    except REFUSALS as error:
        raise Wrong(f"the model {observer!r:.60} of the model file: {said(error)}") from error


def check(proof, plant, log):  # observer, sample and chain of every alarm of a proof
    lines, chain, done = lines_of(proof), None, []
    wanted = {"format": "svo-proof-1", "plant": plant["plant"], "noise": plant["noise"]}
    for number, line in enumerate(lines, start=1):
        try:
            step = parsed(line)
            if number == 1:
                expect(wanted.items() <= step.items(), f"the proof is not of {wanted}")
            elif step["step"] == "chain":
                expect(chain is None, "a chain ends without its alarm")
                observer, sample = step["observer"], count(step["sample"], 0, len(log.time))
                expect(log.time[sample] == real(step["time"]), "a chain's time is not its sample's")
                chain = chain_of(plant, observer, log, sample)
            else:
                expect(chain is not None, "a step stands in no chain")
                chain.take(step)
                if step["step"] == "alarm":
                    done, chain = [*done, (observer, sample, chain)], None
        except REFUSALS as error:
            raise Wrong(f"line {number}: {said(error)}") from error
    expect(chain is None and done, "the proof has no alarm, or a chain without one")
    return done


def said(error):
    return str(error) if isinstance(error, Wrong | OSError) else f"not of the format ({type(error).__name__}: {error})"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("proof", "--model", "--log"):
        parser.add_argument(name, **{"required": True} if name[0] == "-" else {})
    given, begun = parser.parse_args(), time.process_time()
    try:
        plant = parsed(Path(at := given.model).read_bytes())
        expect(plant.get("format") == "svo-plant-1", "the model is not of the format svo-plant-1")
        log = Log(at := given.log, plant["columns"])
        expect(plant["samples"] is None or count(plant["samples"]) == len(log.time), "the model is of another log")
        found = check(at := given.proof, plant, log)
        intervals = array(plant["intervals"], len(log.time) - 1) if "intervals" in plant else None
        last, at = max(sample for _, sample, _ in found), given.log
        log.check_times(last, real(plant["Ts"]), intervals)
    except REFUSALS as error:
        print(f"NOT PROVEN: {at}: {said(error):.250}")
        return 1
    for observer, sample, chain in found:
        print(f"PROVEN: {observer!r} is falsified at sample {sample} ({log.time[sample]:g} s); {chain.checked} steps")
        print(*(f"    given that {premise}" for premise in chain.premises), sep="\n")
    for what, path in (("the models and bounds", given.model), ("the readings", given.log)):
        print(f"given {what} of {path} (sha256 {hashlib.sha256(Path(path).read_bytes()).hexdigest()})")
    print("where a decimal means the nearest double; that w and Delta are held from sample to sample, unless the")
    print("model says that they vary, and that faults begin at samples, which are as far apart as the model says")
    print(f"{len(found)} of {len(found)} alarms proven, in {time.process_time() - begun:.1f} s CPU")
    return 0


if __name__ == "__main__":
    sys.stdout.reconfigure(errors="backslashreplace")
    sys.exit(main())
