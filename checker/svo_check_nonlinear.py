"""Linearisations of nonlinear models for `svo_check.py`: `docs/proof_format.md`, with the standard library alone.

A number is an integer times 2^-160 and an interval a pair of them, rounded outward. Over a box of z with centre c each
slot of a tape has a form: it is in k + g (z - c) + rest, and in values. What a stated linear model leaves out of the
forms is computed here: the proof only chooses the model, and boxes that may hold a trajectory.
"""

import math
from functools import partial

from svo_check import Chain, Model, Set, Wrong, array, count, expect, real, up

P, G = 160, 224  # bits behind the point; of series, whose errors are below 2^-190 then
ONE, MORE, FAR = 1 << P, G - P, 1 << 14
PARTS, MOST_NORM, FARTHEST = 4096, 48, 1 << (P + 30)  # parts of a sample, in which substeps are counted
(VARIABLE, CONSTANT, NEG, ADD, SUB, MUL, SQR, INV, SQRT, EXP, LOG, SIN, COS, TANH, ABS, SIGN, SROOT, MAX, ATAN2, SELECT,
 DIV) = range(21)  # fmt: skip
OPERANDS = {ADD: 2, SUB: 2, MUL: 2, MAX: 2, ATAN2: 2, SELECT: 3, DIV: 2}
pairs = partial(zip, strict=True)


def ends(value):  # of a float
    expect(math.isfinite(value), "a number is not finite")
    top, bottom = value.as_integer_ratio()
    return (top << P) // bottom, -((-top << P) // bottom)


def box_of(low, high):
    return [(ends(a)[0], ends(b)[1]) for a, b in pairs(low, high)]


def at(value):
    return value, value


def plus(*terms):
    return sum(a for a, _ in terms), sum(b for _, b in terms)


def minus(a, b):
    return a[0] - b[1], a[1] - b[0]


def shifted_up(value, bits=P):
    return -(-value >> bits)


def mul(a, b):
    products = a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]
    return min(products) >> P, shifted_up(max(products))


def div(a, b):
    expect(b[0] > 0 or b[1] < 0, "a divisor may be zero")
    ratios = [(x << P, y) for x in a for y in b]
    return min(x // y for x, y in ratios), -min(-x // y for x, y in ratios)


def both(a, b):
    found = max(a[0], b[0]), min(a[1], b[1])
    expect(found[0] <= found[1], "two bounds of a number exclude each other")
    return found


def hull(*intervals):
    return min(a for a, _ in intervals), max(b for _, b in intervals)


def sizes(a):  # least and largest
    return 0 if a[0] <= 0 <= a[1] else min(map(abs, a)), max(-a[0], a[1])


def middle(a):
    return (a[0] + a[1]) >> 1


def radius(a):
    return a[1] - middle(a)  # not the smaller half


def dot(xs, ys):
    return plus((0, 0), *(mul(x, y) for x, y in pairs(xs, ys) if any(x) and any(y)))


def each(function, *matrices):
    return [[function(*entries) for entries in pairs(*rows)] for rows in pairs(*matrices)]


def around(value, error=1 << 30):  # of a number in units of 2^-224
    return ((value - error) >> MORE) - 1, shifted_up(value + error, MORE) + 1


def series(x, term, following):  # units of 2^-224; each term at most half of the one before
    total, i = 0, 0
    while x not in (0, -1):
        total, i = total + term(x, i), i + 1
        x = following(x, i)
    return total


def arctangent(t, sign):  # the hyperbolic one if the sign is 1; |t| <= 1/3
    squared = t * t >> G
    return series(t, lambda x, i: x // (2 * i + 1), lambda x, _: sign * (x * squared >> G))


LN2 = 2 * arctangent((1 << G) // 3, 1)
PI = 16 * arctangent((1 << G) // 5, -1) - 4 * arctangent((1 << G) // 239, -1)  # Machin
HALF_TURN = around(PI)[1]


def exp_at(x):
    expect(x < 1 << (P + 12), "an exponential is beyond all bounds")
    x = max(x, -1 << (P + 12))
    k = ((x << MORE) + LN2 // 2) // LN2
    r = (x << MORE) - k * LN2
    value = series(1 << G, lambda t, _: t, lambda t, i: (t * r >> G) // i)
    low, high = ((v << k) if k >= 0 else (v >> -k) for v in (value - (1 << 30), value + (1 << 30)))
    return max(0, (low >> MORE) - 1), shifted_up(high, MORE) + 2


def log_at(x):
    expect(x > 0, "a logarithm is of a number that may be zero or below")
    e = x.bit_length() - P
    m = (x << MORE) >> e if e >= 0 else x << (MORE - e)
    return around(e * LN2 + 2 * arctangent(((m - (1 << G)) << G) // (m + (1 << G)), 1))


def root_at(x, signed=False):
    expect(x >= 0 or signed, "a root is of a number that may be below zero")
    low = math.isqrt(abs(x) << P)
    found = low, low + (low * low < abs(x) << P)
    return found if x >= 0 else minus((0, 0), found)


def wave_at(x, quarters):  # sin(x + quarters pi / 2)
    j = (2 * (x << MORE) + PI // 2) // PI
    r, turn = (x << MORE) - j * PI // 2, (j + quarters) % 4
    squared, odd = r * r >> G, 1 - turn % 2  # the sine of r, or its cosine
    value = series(r if odd else 1 << G, lambda t, _: t,
                   lambda t, i: -(t * squared >> G) // ((2 * i + odd) * (2 * i - 1 + odd)))  # fmt: skip
    return around(-value if turn > 1 else value, 1 << 50)


def angle_at(y, x):
    a, b = sorted((abs(x), abs(y)))
    t = (a << G) // b
    for _ in range(3):  # halved
        t = (t << G) // ((1 << G) + math.isqrt((1 << 2 * G) + t * t))
    v = 8 * arctangent(t, -1)
    v = PI // 2 - v if abs(y) > abs(x) else v
    v = PI - v if x < 0 else v
    return around(-v if y < 0 else v)


def rising(function):
    return lambda a: (function(a[0])[0], function(a[1])[1])


def wave(a, quarters):
    if radius(a) >= 3 * ONE or sizes(a)[1] >= FARTHEST:
        return -ONE, ONE
    low, high = hull(*(wave_at(v, quarters) for v in a))
    near, (first, last) = 1 << 50, (2 * (v << MORE) for v in a)
    j = [j for j in range(first // PI - 1, last // PI + 2) if first - near <= j * PI <= last + near]
    extremes = {(i + quarters) % 4 for i in j}
    return -ONE if 3 in extremes else low, ONE if 1 in extremes else high


def square(a):
    low, high = sizes(a)
    return low * low >> P, shifted_up(high * high)


RANGE = {
    SQR: square, INV: partial(div, at(ONE)), SQRT: rising(root_at), EXP: rising(exp_at), LOG: rising(log_at),
    SIN: partial(wave, quarters=0), COS: partial(wave, quarters=1),
    TANH: rising(lambda x: minus(at(ONE), div(at(2 * ONE), plus(exp_at(min(2 * x, 400 * ONE)), at(ONE))))),
    ABS: sizes, SROOT: rising(partial(root_at, signed=True)),
    SIGN: lambda a: (ONE if a[0] > 0 else -ONE, -ONE if a[1] < 0 else ONE),  # at zero a switch may slide
}  # fmt: skip


def turns(op, q, a):  # hold the points of a where a function has the slope q, or a kink
    found = [(0, 0)] if op in (ABS, SROOT) else []
    if op == SQR:
        found.append((q >> 1, (q >> 1) + 1))
    elif op in (SQRT, SROOT, INV) and q and (q < 0) is (op == INV):
        s = math.isqrt(ONE**3 // -q) if op == INV else ONE**3 // (4 * q * q)
        found += (s, s + 1), (-s - 1, -s)
    elif op in (EXP, LOG) and q > 0:
        found.append(log_at(q) if op == EXP else (ONE * ONE // q, ONE * ONE // q + 1))
    elif op == TANH and 0 < q <= ONE:
        log = rising(log_at)(plus(at(ONE), root_at(ONE - q)))
        low, high = minus(plus(log, log), log_at(q))
        found += (low >> 1, (high >> 1) + 1), (-(high >> 1) - 1, -(low >> 1))
    elif op in (SIN, COS) and abs(q) <= ONE:
        r = math.isqrt(ONE * ONE - q * q)
        alpha = hull(angle_at(r, q), angle_at(r + 1, q))
        for m in range((a[0] << MORE) // (2 * PI) - 2, (a[1] << MORE) // (2 * PI) + 3):
            shift = around((4 * m - (op == COS)) * PI // 2, 1 << 50)
            found += plus(shift, alpha), minus(shift, alpha)
    return [both(t, a) for t in found if t[0] <= a[1] and a[0] <= t[1]]


def rest_at(op, a, q):  # the range of a function less q times its argument
    return hull(*(minus(RANGE[op](t), mul(at(q), t)) for t in (at(a[0]), at(a[1]), *turns(op, q, a))))


def slopes(op, a):  # the chord's, a wave's in the middle, or that of the narrowest rest
    found = [middle(div(minus(RANGE[op](at(a[1])), RANGE[op](at(a[0]))), at(a[1] - a[0])))]
    if op == SROOT and a[0] < 0 < a[1]:
        root = root_at(sizes(a)[1])[1]
        low, high = (div(at(s), at(root))[0] for s in (ONE // 2, 17 * ONE // 10))
    elif op in (SIN, COS, TANH) and radius(a) > ONE // 4:
        low, high = 0 if op == TANH else -ONE, ONE
    else:
        return [middle(wave_at(middle(a), 1 if op == SIN else 2))] if op in (SIN, COS) else found
    for _ in range(12):
        p, q = high - (high - low) * 618 // 1000, low + (high - low) * 618 // 1000
        low, high = (low, q) if radius(rest_at(op, a, p)) < radius(rest_at(op, a, q)) else (p, high)
    return [(low + high) >> 1, *found]


def secant(op, a, values):  # a slope, and the range of a function less the slope times its argument
    if op == SIGN or a[0] == a[1] or (op in (SIN, COS) and (radius(a) > 20 * ONE or sizes(a)[1] >= FARTHEST)):
        return 0, values
    found = [(q, rest_at(op, a, q)) for q in slopes(op, a)] + [(0, values)]
    return min(found, key=lambda f: radius(f[1]))


class Over:  # forms over a box, linear in its first coordinates: k, g, rest, values, and what g (z - c) is at most.
    def __init__(self, box, free):
        self.radius, eye = [radius(a) for a in box[:free]], [[ONE * (i == j) for j in range(free)] for i in range(free)]
        self.variables = [self.form(middle(a), g, (0, 0), a) for a, g in zip(box, eye, strict=False)]
        self.variables += map(self.anywhere, box[free:])

    def form(self, k, g, rest, values, *cut):  # of slopes that lost bits as k did, being products of those in `cut`
        reach = shifted_up(sum(abs(x) * r for x, r in pairs(g, self.radius)))
        lost = sum(1 + sum((r >> P) + 1 for x, r in pairs(of, self.radius) if x) for of in cut)
        rest = both((rest[0] - lost, rest[1] + lost), (values[0] - k - reach, values[1] - k + reach))
        k, rest = k + middle(rest), minus(rest, at(middle(rest)))
        return k, g, rest, both(values, (k - reach + rest[0], k + reach + rest[1])), reach

    def anywhere(self, a):
        return self.form(0, [0] * len(self.radius), a, a)

    def add(self, a, b, sign=1):
        rest, values = (plus(a[i], b[i]) if sign > 0 else minus(a[i], b[i]) for i in (2, 3))
        return self.form(a[0] + sign * b[0], [x + sign * y for x, y in pairs(a[1], b[1])], rest, values)

    def sloped(self, a, q, rest, values):
        own = plus(mul(at(q), a[2]), rest)
        return self.form(q * a[0] >> P, [q * x >> P for x in a[1]], own, values, a[1])

    def apply(self, op, a):
        values = RANGE[op](a[3])
        return self.sloped(a, *secant(op, a[3], values), values)

    def times(self, a, b):  # deviations times each other are bounded by pairs, squares keep their sign
        moved = [(x * r, y * r) for x, y, r in pairs(a[1], b[1], self.radius) if x or y]
        squares = [p * q for p, q in moved]
        mixed = sum(abs(p * y + x * q) for i, (p, q) in enumerate(moved) for x, y in moved[:i])
        low, high = sum(min(0, s) for s in squares) - mixed, sum(max(0, s) for s in squares) + mixed
        bend = low >> 3 * P, shifted_up(high, 3 * P)
        cross = shifted_up(a[4] * sizes(b[2])[1] + b[4] * sizes(a[2])[1])
        rest = plus(mul(at(a[0]), b[2]), mul(at(b[0]), a[2]), mul(a[2], b[2]), (-cross, cross), bend)
        g = [(a[0] * y + b[0] * x) >> P for x, y in pairs(a[1], b[1])]
        return self.form(a[0] * b[0] >> P, g, rest, mul(a[3], b[3]), a[1], b[1])

    def over(self, a, b):  # a / b = q + (a - q b) / b, for the q that leaves least
        inverse, values, found = self.apply(INV, b), div(a[3], b[3]), []
        along = sum(x * y * r * r for x, y, r in pairs(a[1], b[1], self.radius))
        across = sum((y * r) ** 2 for y, r in pairs(b[1], self.radius))
        for q in {0, (a[0] << P) // b[0] if b[0] else 0, (along << P) // across if across else 0}:
            left = self.add(a, self.sloped(b, q, (0, 0), mul(at(q), b[3])), -1)
            found.append(self.add(self.anywhere(at(q)), self.times(left, inverse)))
            values = both(values, found[-1][3])
        return self.form(*min(found, key=lambda f: radius(f[2]))[:3], values)

    def angle(self, fy, fx):  # by second order about the middle, or the range alone where that is narrower
        y, x, squares = fy[3], fx[3], plus(square(fx[3]), square(fy[3]))
        if (y[0] <= 0 <= y[1] and x[0] <= 0 <= x[1]) or (x[0] < 0 and y[0] < 0 <= y[1]) or square(squares)[0] <= 0:
            return self.anywhere((-HALF_TURN, HALF_TURN))
        flat = self.anywhere(hull(*(angle_at(t, s) for t in y for s in x)))
        v, u, dy, dx = middle(y), middle(x), radius(y), radius(x)
        here, to_x, to_y = plus(square(at(u)), square(at(v))), (0, square(at(dx))[1]), (0, square(at(dy))[1])
        by_x, by_y, fourth = div(at(-v), here), div(at(u), here), square(squares)
        p, q = middle(by_x), middle(by_y)
        off = plus(mul((-dx, dx), minus(by_x, at(p))), mul((-dy, dy), minus(by_y, at(q))))
        mixed = mul(div(minus(square(y), square(x)), fourth), mul((-dx, dx), (-dy, dy)))
        bend = plus(mul(div(mul(x, y), fourth), minus(to_x, to_y)), mixed)
        most = div(plus(to_x, to_y), squares)[1] // 2 + 1  # eigenvalues of its Hessian are +-1 / (x^2 + y^2)
        start = minus(angle_at(v, u), plus(mul(at(p), at(u)), mul(at(q), at(v))))
        rest = plus(start, off, both(bend, (-most, most)))
        part = self.sloped(fx, p, (0, 0), mul(at(p), x))
        k, g, rest, own, _ = self.add(part, self.sloped(fy, q, rest, plus(mul(at(q), y), rest)))
        found = self.form(k, g, rest, both(flat[3], own))
        return found if sizes(found[2])[1] < sizes(flat[2])[1] else flat

    def slot(self, op, of, constant, slots):
        if op in (VARIABLE, CONSTANT):
            return self.variables[of[0]] if op == VARIABLE else self.anywhere(constant)
        a = slots[of[0]]
        if op == SELECT and (a[3][0] >= 0 or a[3][1] < 0):
            return slots[of[2] if a[3][0] >= 0 else of[1]]
        if len(of) == 1:
            return self.add(self.anywhere((0, 0)), a, -1) if op == NEG else self.apply(op, a)
        a, b = (slots[i] for i in of[-2:])
        if op in (MUL, DIV, ATAN2):
            return {MUL: self.times, DIV: self.over, ATAN2: self.angle}[op](a, b)
        gap, total = self.add(a, b, -1), self.add(a, b)
        if op in (ADD, SUB):
            return total if op == ADD else gap
        if op == MAX and not gap[3][0] < 0 < gap[3][1]:
            return a if gap[3][0] >= 0 else b
        half = sizes(gap[3])[1] // 2 + 1 if op == SELECT else 0
        twice = total if op == SELECT else self.add(total, self.apply(ABS, gap))
        return self.sloped(twice, ONE // 2, (-half, half), hull(a[3], b[3]))

    def forms(self, tape):  # of the rows; what has no value counts only where it is read
        slots, why = {}, []
        for i, (op, of, constant) in enumerate(tape.program):
            try:
                slots[i] = self.slot(op, of, constant, slots)
            except (KeyError, Wrong) as error:
                why.append(error)
        expect(all(i in slots for i in tape.rows), f"a row of a tape has no value: {(why or [''])[0]}")
        return [slots[i] for i in tape.rows]


class Tape:
    def __init__(self, record, variables, rows):
        op, operands, self.rows = record["op"], record["operands"], record["rows"]
        constants = array(record["constants"], len(op), 2)
        for i, (o, of, (low, high)) in enumerate(pairs(op, operands, constants)):
            is_one = count(o) <= DIV and len(of) == OPERANDS.get(o, 1) and low <= high
            expect(is_one and [count(j, 0, variables if o == VARIABLE else max(i, 1)) for j in of], "a slot is none")
        expect(len(self.rows) == rows and all(count(i, 0, len(op)) >= 0 for i in self.rows), "a tape has other rows")
        self.program = [*pairs(op, operands, box_of(*pairs(*constants)))]


def exponential(J, h, unit):  # and its integral over t from 0 to h, as intervals; units: 2^unit
    order, eye = range(len(J)), [[ONE * (i == j) for j in range(len(J))] for i in range(len(J))]
    move = [[unit[j] - unit[i] for j in order] for i in order]
    N = each(lambda x, m: x * h << FAR >> FAR + P - m, J, move)
    norm = (max(sum(map(abs, row)) for row in N) >> P) + 1
    expect(norm <= MOST_NORM and max(map(abs, unit)) < FAR // 4, "a substep is too long for its slopes")
    total, integral, term, off, lost, left, k = eye, each(lambda x: x * h >> P, eye), eye, 0, 0, ONE, 0
    while k < 2 * norm or left >= 1 << 20:  # from there on terms at least halve: what follows is at most the last one
        k, off = k + 1, off * norm // (k + 1) + 2
        term = [[sum(N[i][m] * term[m][j] for m in order) // (k << P) for j in order] for i in order]
        total = each(lambda x, y: x + y, total, term)
        integral = each(lambda x, y, d=k + 1: x + y * h // (d << P), integral, term)
        lost, left = lost + off, max(sum(map(abs, row)) for row in term) + len(J) * off
    lost += left + len(J) * 3**norm  # the last for the bits that N has lost
    outward = lambda matrix, d: each(  # noqa: E731
        lambda x, m: ((x - d) << FAR >> FAR + m, ((x + d) << FAR >> FAR + m) + 1), matrix, move
    )
    return outward(total, lost), outward(integral, (lost * h >> P) + k + 1)


def lines_of(forms, box):  # rows as slopes and a constant, all intervals
    centre = [at(middle(a)) for a in box]
    return [([*map(at, g)], minus(plus(at(k), rest), dot(map(at, g), centre))) for k, g, rest, *_ in forms]


def range_of(given, n, outward):  # as integers; what is infinite stays so
    low, high = [[-math.inf] * n, [math.inf] * n] if given is None else (array(end, n) for end in given)
    whole = lambda v, end: v if math.isinf(v) else ends(v)[end]  # noqa: E731
    return [(whole(a, not outward), whole(b, outward)) for a, b in pairs(low, high)]


class Equations(Model):  # a nonlinear model: what has been linearised of it stands in the place of its matrices.
    def __init__(self, record, plant):
        n, nu, ny, nw = (count(record[key]) for key in ("n", "inputs", "outputs", "disturbances"))
        shape, told = [0, 1, n + ny, n + nu + 1 + nw], record["equations"]
        super().__init__(record | {"matrices": {"stacks": {"shape": shape, "hex": ""}}})
        self.nw, self.is_map = count(nw - n), [True, False].index(told["continuous"])  # nothing else
        self.varies, parts = {*map(count, told["varying"])}, (slice(self.nw), slice(self.nw, nw))
        self.times = array(plant["intervals"], None) if "intervals" in plant else [real(plant["Ts"])]
        self.w, left_out = (box_of(*(row[part] for (row,) in self._bounds[1:])) for part in parts)  # all samples'
        others = *self._remainder, *(row[self.nw :] for row in self.w_set.rows), self.delta, self.sums
        is_one = max(self.varies, default=-1) < self.nw and left_out == [(-ONE, ONE)] * n
        expect(is_one and not any(map(any, others)), "the model has an entry that is none of a nonlinear one")
        self.f, self.h = (Tape(told[name], n + self.nw + nu, rows) for name, rows in (("f", n), ("h", ny)))
        self.valid, self.held = range_of(told["valid"], n, False), range_of(record["physical"], n, True)
        Set([*pairs(*self.valid)]).within(Set([*pairs(*self.held)])).expect_point("the range of the equations")
        self.premises += ["the equations hold where the state is in their range"] * (told["valid"] is not None)
        self.transitions, self.readings, self.nothing = {}, {}, [[0.0] * self.columns] * self.rows

    def stack(self, k, vertex=()):
        rows = self.transitions.get(k, self.nothing[: self.n]) + self.readings.get(k, (self.nothing[self.n :],))[0]
        self._stacks, self._known = [[rows]], {}
        return super().stack(k, vertex)

    def bounds(self, k):
        return [*super().bounds(k)[:3], self.readings[k][1] if k in self.readings else [0.0] * self.ny]

    def forms(self, tape, box, u, is_known=True):
        for a, (low, high) in pairs(box, self.valid) if is_known else ():
            expect(low <= a[0] and a[1] <= high, "a state may be where the equations do not hold")
        return Over([*box, *self.w, *map(ends, u)], self.n + self.nw).forms(tape)

    def image(self, start, forms, box, h):  # start + [0, h] f; in a row that falls with its own state, f at its ends
        for i, (a, b, (k, g, rest, (low, high), reach)) in enumerate(pairs(start, box, forms)):
            if g[i] <= 0:
                others = reach - (abs(g[i]) * radius(b) >> P)
                low = max(low, k + rest[0] - others + (g[i] * (a[0] - middle(b)) >> P))
                high = min(high, k + rest[1] + others + shifted_up(g[i] * (a[1] - middle(b))))
            yield a[0] + (min(0, low) * h >> P) - 1, a[1] + shifted_up(max(0, high) * h) + 1

    def enclosed(self, start, box, u, h):  # the part of a box that holds the state for a time h, and the forms over it
        image = [*self.image(start, self.forms(self.f, box, u, is_known=False), box, h)]
        for a, b, (low, high) in pairs(image, box, self.held):
            expect((b[0] < a[0] or b[0] <= low) and (a[1] < b[1] or high <= b[1]), "a box does not hold the trajectory")
        return (box := [both(a, b) for a, b in pairs(image, box)]), self.forms(self.f, box, u)

    def substep(self, lines, box, forms, h):  # rows in the first x, w and a constant, after h in a box
        n, own = self.n, lines_of(forms, [*box, *self.w])
        J, W = [[g[0] for g in line[0][:n]] for line in own], [line[0][n:] for line in own]
        moved = [sum(abs(x) * radius(b) for x, b in pairs(row, box)) * h >> 2 * P for row in J]
        unit = [(radius(a) + m + 1).bit_length() for a, m in pairs(box, moved)]
        metzler = [[x if i == j else abs(x) for j, x in enumerate(row)] for i, row in enumerate(J)]
        (move, gain), (_, carry) = exponential(J, h, unit), exponential(metzler, h, unit)
        moving = [plus(line[1], *(mul(line[0][n + j], self.w[j]) for j in self.varies)) for line in own]
        held = [[(0, 0)] * n + [(0, 0) if j in self.varies else g for j, g in enumerate(row)] for row in W]
        for by_x, by_f, by_rest in pairs(move, gain, carry):
            rest = shifted_up(sum(max(0, c[1]) * radius(a) for c, a in pairs(by_rest, moving)))
            constant = plus(dot(by_x, [line[1] for line in lines]), dot(by_f, [at(middle(a)) for a in moving]))
            columns = pairs(pairs(*(line[0] for line in lines)), pairs(*held))
            yield [plus(dot(by_x, x), dot(by_f, g)) for x, g in columns], plus(constant, (-rest, rest))

    def transition(self, start, u, step):  # the next state as rows, and a box that holds it
        if self.is_map:
            forms = self.forms(self.f, start, u)
            return lines_of(forms, [*start, *self.w]), [f[3] for f in forms]
        shares, first = step["substeps"], [*start, *self.w]
        part, least = ends(self.times[0 if len(self.times) == 1 else step["sample"]] / PARTS)
        expect(sum(count(s, 1) for s in shares) == PARTS and part == least > 0, "the substeps are no whole sample")
        lines = [([at(ONE * (i == j)) for j in range(len(first))], (0, 0)) for i in range(self.n)]
        for share, bounds in pairs(shares, array(step["boxes"], len(shares), 2, self.n)):
            box, forms = self.enclosed(start, box_of(*bounds), u, part * share)
            image = self.image(start, forms, box, part * share)
            lines = [*self.substep(lines, box, forms, part * share)]
            start = [both(both(a, b), plus(line[1], dot(line[0], first))) for a, b, line in pairs(box, image, lines)]
        return lines, start

    def output(self, box, u):  # rows; what varies need not be the w of the next step
        for line, constant in lines_of(self.forms(self.h, box, u), [*box, *self.w]):
            moving = [mul(line[self.n + j], self.w[j]) for j in self.varies]
            yield [(0, 0) if j - self.n in self.varies else g for j, g in enumerate(line)], plus(constant, *moving)


class Linearised(Chain):  # a chain whose samples are linearised over what it has proven of them.
    def __init__(self, record, plant, log, claimed):
        super().__init__(Equations(record, plant), log, claimed)

    def take(self, step):
        kind, model = step["step"], self.model
        if kind not in ("output", "transition"):
            if kind == "start":
                model.transitions, model.readings = {}, {}
            return super().take(step)
        k, box = self._sample(step["sample"]), [*pairs(*self._set(step["sample"]).box)]
        expect(all(low <= high for low, high in box), "two bounds of a state exclude each other")
        box, u = box_of(*pairs(*box)), self.log.u[k]
        if kind == "output":
            rows, rest = self._rows(step, "CcFR", model.output(box, u), [*box, *model.w], model.ny)
            model.readings[k] = [row + [0.0] * model.n for row in rows], rest
        else:
            lines, after = model.transition(box, u, step)
            rows, rest = self._rows(step, "AaER", lines, [*box, *model.w], model.n)
            rows = [row + [r * (i == j) for j in range(model.n)] for i, (row, r) in enumerate(pairs(rows, rest))]
            model.transitions[k] = rows
            for i, (low, high) in enumerate(after):
                self.bounds[k + 1, i, -1], self.bounds[k + 1, i, 1] = -up(-low / ONE), up(high / ONE)
        self.checked += 1

    def _set(self, k):  # bounds of the first sample too
        box = [[self.bounds.get((k, i, side), side * math.inf) for i in range(self.model.n)] for side in (-1, 1)]
        return super()._set(k).within(Set(box))

    def _rows(self, step, names, lines, box, rows):  # rows of (x, u, 1, w), and what they say that they leave out
        model, found = self.model, []
        A, a, E, R = (array(step[name], rows, *more) for name, more in pairs(names, [(model.n,), (), (model.nw,), ()]))
        for line, x, one, w, rest in pairs(lines, A, a, E, R):
            gaps = [minus(g, ends(v)) for g, v in pairs(line[0], x + w)]
            off = plus(minus(line[1], ends(one)), dot(gaps, [at(middle(b)) for b in box]))
            left_out = sizes(off)[1] + shifted_up(sum(sizes(g)[1] * radius(b) for g, b in pairs(gaps, box)))
            expect(left_out <= ends(rest)[0], "a linear model leaves out more than it says")
            found.append([*x, *[0.0] * model.nu, one, *w])
        return found, R

    def _total(self, step, *objective, vertex=()):
        first, last, known = self._sample(step["first"]), self._sample(step["last"]), self.model
        expect(all(k in known.transitions for k in range(first, last)), "a sample of a window is not linearised")
        read = enumerate(array(step["on_output"], None, known.ny), first)
        expect(all(k in known.readings for k, row in read if any(row)), "an output of a window is not linearised")
        return super()._total(step, *objective, vertex=vertex)
