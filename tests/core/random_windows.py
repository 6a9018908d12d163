"""Windows of random sizes, states and samples, in the process that `fuzz` starts with the sanitized library.

``python -m tests.core.random_windows SEED FIRST END`` prints the number of each case before it runs.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from svo.observers import window_kernel as kernel
from svo.observers.window.memory import Memory

Generator = np.random.Generator

LIMIT = 300  # pivots
STRANGE = np.array([0.0, -0.0, 1.0, -1.0, 1e-320, 1e-200, 1e-9, 1e9, 1e29, 1e31, 1e200, 1e308, -1e308])
NO_NUMBERS = np.array([np.nan, np.inf, -np.inf])
KINDS = ("its own", "its own", "damaged", "arbitrary")


def sizes(rng: Generator) -> kernel.Sizes:
    """What an observer may choose, and smaller bases."""
    n, steps, items = int(rng.integers(1, 6)), int(rng.integers(1, 9)), int(rng.integers(1, 4))
    nu, nw, ny, nq, nh = (int(rng.integers(0, most)) for most in (3, 4, 4, 4, 3))
    nt, na = n + int(rng.integers(0, 3)), int(rng.integers(0, 4))
    return kernel.Sizes(
        n=n, nu=nu, nw=nw, ny=ny, nq=nq, nh=nh, nt=nt, na=max(nt - n, na), ni=1 + (items if nq else 0),
        N=steps, block=int(rng.integers(1, steps + 1)), K=int(rng.integers(2, 12)), late=int(rng.integers(0, 2)),
    )  # fmt: skip


def memory_of(size: kernel.Sizes) -> Memory:
    """Of an observer that would choose these sizes."""
    memory, block = Memory.__new__(Memory), kernel.allocate(size)
    largest = min(block.arrays["G"].shape) + 2
    memory.__setstate__({"size": size, "block": block, "given": {}, "largest_basis": largest})
    return memory


def numbers(rng: Generator, shape: tuple[int, ...], strange: float, missing: float = 0.0) -> Any:
    """Of about one; a share of them strange, and a share no numbers."""
    values, which = rng.normal(size=shape), rng.random(shape)
    values = np.where(which < strange, rng.choice(STRANGE, shape), values)
    return np.where(which > 1.0 - missing, rng.choice(NO_NUMBERS, shape), values)


def prepare(rng: Generator, memory: Memory, strange: float) -> None:
    """What an observer fixes, and where it starts."""
    arrays, size = memory.arrays, memory.size
    for name in ("T", "delta", "w_rows", "w_rows_lower", "w_rows_upper"):
        arrays[name][...] = numbers(rng, arrays[name].shape, strange)
    arrays["owner"][:] = np.sort(rng.integers(1, max(size.ni, 2), size.nq))
    arrays["delta"].sort(axis=1)
    arrays["jitter"][:] = 1e-11 * rng.random(arrays["jitter"].size)
    width = np.abs(numbers(rng, (size.nt,), strange))
    arrays["h_lower"][:], arrays["h_upper"][:] = -width, width
    count = int(rng.integers(0, size.na + 1))
    rows, ends = numbers(rng, (count, size.n), strange), np.abs(numbers(rng, (count,), strange))
    kernel.initialise(memory.address, rows, -ends, np.where(rng.random(count) < 0.2, np.inf, ends))


def damage(rng: Generator, memory: Memory, share: float) -> bool:
    """Other numbers for a share of every array that a state holds; whether the check of saved states lets it pass."""
    size, arrays = memory.size, memory.arrays
    ends = {"k": size.K, "rows": len(arrays["G"]), "cols": len(arrays["GT"]), "status": 4, "owner": size.ni}
    for name, array in memory.kept.items():
        there = rng.random(array.shape) < share
        if array.dtype == np.float64:
            array[there] = numbers(rng, array.shape, 0.3, rng.choice([0.0, 0.2]))[there]
        elif name in ends:
            array[there] = rng.integers(0, max(ends[name], 1), array.shape)[there]
        elif name == "seen_base":
            array[there] = rng.choice([-(2**63), -1, 0, 1, 5, 2**63 - 1], array.shape)[there]
    if rng.random() < share:
        clock = arrays["clock"]
        clock[:] = rng.choice([0, 1, 2, 3, 100, 2**53 - 1], clock.shape)
        clock[rng.random(clock.shape) < 0.02] = rng.choice([-1, 2**53, 2**63 - 1])
        clock[kernel.TIME] = min(int(clock[kernel.BASE]) + int(rng.integers(0, size.N + 1)), 2**63 - 1)
        clock[[kernel.STAGE, kernel.NEXT]] = rng.random() < 0.02
        clock[[kernel.STARTED, kernel.PENDING]] = rng.integers(0, 2, 2)
    try:
        memory.check_clock()
    except ValueError:
        return False
    return True


def give(rng: Generator, memory: Memory, strange: float) -> None:
    """The data of a sample, as they are handed over: NaN in y only, but now and then."""
    arrays, size = memory.arrays, memory.size
    wrong = rng.choice([0.0, 0.0, 0.0, 0.02])
    for name in ("in_u", "in_u_next", "in_stack"):
        arrays[name][...] = numbers(rng, arrays[name].shape, strange, wrong)
    arrays["in_stack"][0, :, : size.n] *= 0.4
    if rng.random() < 0.7:  # of the ranks that the channels have
        for item in range(1, size.ni):
            (rows, columns), rank = arrays["in_stack"][item].shape, int((arrays["owner"] == item).sum())
            arrays["in_stack"][item] = 0.1 * rng.normal(size=(rows, rank)) @ rng.normal(size=(rank, columns))
    y = numbers(rng, (size.ny,), strange, wrong)
    arrays["in_y"][:] = np.where(rng.random(size.ny) < 0.2, np.nan, y)
    arrays["in_noise"][:] = np.abs(numbers(rng, (size.ny,), strange)) + rng.choice([0.0, 3.0])
    width = np.abs(numbers(rng, (size.nw,), strange))
    arrays["in_w_lower"][:], arrays["in_w_upper"][:] = -width, width


def drive(rng: Generator, memory: Memory, strange: float) -> bool:
    """One call, as the observer may make it; whether the window is of use still."""
    call, size = rng.choice(["take", "take", "take", "solve", "late", "channel", "follow"]), memory.size
    if call == "take" or not memory.started:
        give(rng, memory, strange)
        while (found := kernel.take(memory.address, 1e-15, LIMIT))[1] == kernel.FULL:
            memory.enlarge(2 * memory.size.K)
        assert found[0] <= kernel.OUTGROWN
        return found[0] != kernel.OUTGROWN
    samples = range(memory.base, memory.time + 1)
    if call == "solve":
        memory.arrays["query"][:] = numbers(rng, (size.n,), strange)
        task = int(rng.choice([kernel.ARRIVAL, kernel.NEWEST, kernel.QUERY]))
        verdict, program = memory.solve(task, 0, kernel.ALL, LIMIT)
        assert -1 <= program < 2 * size.nt
        assert verdict <= kernel.UNDECIDED
    elif call == "late" and len(samples):
        give(rng, memory, strange)
        kernel.add_late(memory.address, int(rng.choice(samples)), 1e-15)
    elif call == "channel" and size.nq and len(samples) > 1:
        low, high = np.sort(numbers(rng, (2,), strange))
        kernel.redraw_channel(memory.address, int(rng.choice(samples[:-1])), int(rng.integers(size.nq)), low, high)
    elif call == "follow":
        return follow(rng, memory, strange)
    return True


def follow(rng: Generator, memory: Memory, strange: float) -> bool:
    count, names = int(rng.integers(1, 5)), ("u", "u_next", "y", "stack", "noise", "w_lower", "w_upper")
    rows: list[list[Any]] = [[] for _ in names]
    for _ in range(count):
        give(rng, memory, strange)
        for row, name in zip(rows, names, strict=True):
            row.append(memory.arrays[f"in_{name}"].copy())
    scheduled = rng.random() < 0.5
    given = [np.ascontiguousarray(row if i < 3 or scheduled else row[:1]) for i, row in enumerate(rows)]
    boxes = np.empty((count, 2, memory.size.n)) if rng.random() < 0.5 else None
    done, told = kernel.follow(memory.address, tuple(given), 1e-15, LIMIT, boxes)
    assert 0 <= done <= count
    code, *_ = memory.go_on(told, 1e-15)
    return code != kernel.OUTGROWN


def case(rng: Generator) -> bool:
    """One window; whether its state was let pass."""
    memory, strange = memory_of(sizes(rng)), float(rng.choice([0.0, 0.05, 0.5]))
    kind = rng.choice(KINDS)
    prepare(rng, memory, strange)
    for _ in range(int(rng.integers(1, 12))):
        if not drive(rng, memory, strange):
            break
    if kind != "its own" and not damage(rng, memory, 0.05 if kind == "damaged" else 1.0):
        return False
    for _ in range(int(rng.integers(1, 20))):
        if not drive(rng, memory, strange):
            break
    return True


def main() -> None:
    seed, first, end = map(int, sys.argv[1:])
    np.seterr(all="ignore")
    passed = 0
    for number in range(first, end):
        print(number, flush=True)
        passed += case(np.random.default_rng([seed, number]))
    print(f"{passed} of {end - first} states were let pass", file=sys.stderr)


if __name__ == "__main__":
    main()
