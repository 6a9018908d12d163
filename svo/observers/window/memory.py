"""The memory of a window: what is fixed of its observer, and the kernel's arrays in one block; all in normal form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.models import NormalForm
from svo.observers import window_kernel as kernel
from svo.observers.window.output_injection import OutputInjection, can_inject
from svo.observers.window.sample import Sample
from svo.observers.window.setup import channel_owners, disturbance_rows, jitter, output_is_disturbed

_GROWING_START = 16
_FIRST_BASIS = 32  # rows that a basis has room for at first; most stay far below
_MOST_BYTES = 8 * 2**30
_MOST_COUNTED = 2**53  # samples, pivots: a state that claims more was not reached, and counts must not overflow


FIXED = ("T", "owner", "delta", "w_rows", "w_rows_lower", "w_rows_upper")
"""Arrays of a window that follow from its settings."""

_MAY_MISS = ("y", "given.y")  # readings
_MAY_BE_OPEN = ("lower", "upper", "noise", "slack")  # how names of bounds end


@dataclass(frozen=True, eq=False)
class WindowSettings:
    """What every window of an observer has in common.

    Attributes
    ----------
    form : NormalForm
    horizon : int or None
    template : (r, n) array
        In normal form.
    eps : float
    sign_split : int
        As in `svo.WindowObserver`.
    slide : int or None
        Samples that the window slides by, at most N, where tests ask for another number than 2 N // 5.
    """

    form: NormalForm
    horizon: int | None
    template: Array
    eps: float
    sign_split: int
    slide: int | None = None

    @cached_property
    def block(self) -> int:
        """Samples that the window slides by."""
        return self.slide or (1 if self.horizon is None else max(1, 2 * self.horizon // 5))

    @property
    def first_steps(self) -> int:
        """Steps that an empty window has room for."""
        return _GROWING_START if self.horizon is None else self.horizon + self.block - 1

    @cached_property
    def owner(self) -> NDArray[np.int64]:
        """Item of the stack that each channel belongs to."""
        return channel_owners(self.form.model)

    @cached_property
    def output_is_disturbed(self) -> bool:
        """Whether w and channels enter the output, so that they take part at their own sample."""
        return output_is_disturbed(self.form.model)

    @cached_property
    def injection(self) -> OutputInjection | None:
        """Where exact sensors read the disturbance."""
        model = self.form.model
        sizes = model.n_states, model.n_inputs, model.n_disturbances
        return OutputInjection(*sizes) if can_inject(model) else None


class Memory:
    """The block of a window and its arrays by name, anchored at nothing yet; it grows where a basis needs more room.

    Attributes
    ----------
    size : Sizes
    block : Block
        The kernel's.
    given : dict of str to array
        Data as given, where the kernel's are not.
    arrays : dict of str to array
        Of both.
    address : int
        What the kernel takes.
    """

    def __init__(self, settings: WindowSettings, anchor_rows: int, steps: int, least_basis: int = 0) -> None:
        model, owner, template = settings.form.model, settings.owner, settings.template
        n, nq, injection = model.n_states, len(owner), settings.injection
        nw = model.n_disturbances + (0 if injection is None else n)
        w_rows = disturbance_rows(settings.form)
        nv, nr = nw + nq, model.n_outputs + len(w_rows[0]) + 2 * nq
        na = max(len(template), anchor_rows)
        rows, columns = na + (steps + 1) * nr, n + (steps + 1) * nv
        self.largest_basis = min(rows, columns) + 2
        self.size = kernel.Sizes(
            n=n, nu=model.n_inputs, nw=nw, ny=model.n_outputs, nq=nq, nh=len(w_rows[0]), nt=n + len(template), na=na,
            ni=1 + len(model.uncertainties), N=steps, block=settings.block,
            K=min(self.largest_basis, max(_FIRST_BASIS, least_basis)), late=int(settings.output_is_disturbed),
        )  # fmt: skip
        self.block = _room_for(self.size)
        self.given = {} if injection is None else injection.allocate(self.size)
        self._name_arrays()
        arrays = self.arrays
        arrays["T"][:n] = np.eye(n)
        arrays["T"][n:] = template
        arrays["owner"][:] = owner
        arrays["delta"][:] = np.array([model.uncertainties[i - 1].bounds for i in owner]).reshape(-1, 2)
        arrays["w_rows"][:, : model.n_disturbances], arrays["w_rows_lower"][:], arrays["w_rows_upper"][:] = w_rows
        arrays["jitter"][:] = jitter(arrays["jitter"].size)

    def _name_arrays(self) -> None:
        self.address, self.arrays = self.block.address, self.block.arrays | self.given

    def __getstate__(self) -> dict[str, Any]:
        names = ("size", "block", "given", "largest_basis")
        return {name: getattr(self, name) for name in names}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__ |= state
        self._name_arrays()

    @property
    def kept(self) -> dict[str, NDArray[Any]]:
        """The arrays that a saved state holds."""
        return {name: self.block.arrays[name] for name in self.block.kept} | self.given

    @property
    def time(self) -> int:
        """Newest sample, as the kernel counts from the start of its window."""
        return int(self.arrays["clock"][kernel.TIME])

    @property
    def base(self) -> int:
        """Oldest sample."""
        return int(self.arrays["clock"][kernel.BASE])

    @property
    def started(self) -> bool:
        return bool(self.arrays["clock"][kernel.STARTED])

    @property
    def slot(self) -> int:
        """Where the data of the newest sample are."""
        return self.time % (self.size.N + 1)

    @property
    def variables(self) -> int:
        """Where the variables of the newest sample are that has any."""
        return self.time % (self.size.N + self.size.late)

    def copy_from(self, smaller: Memory) -> None:
        """What a smaller one holds whose samples have not wrapped around: every array is a leading block of its own."""
        _copy_leading(smaller.kept, self.arrays)

    # -- what the kernel does --------------------------------------------------------------------------

    def take(self, sample: Sample, eps: float) -> tuple[int, int, int]:
        """`kernel.take_sample`, with as much room for bases as it needs."""
        return self.go_on(kernel.take_sample(self.address, sample[:-1], eps, kernel.UNLIMITED), eps)

    def go_on(self, found: tuple[int, int, int], eps: float) -> tuple[int, int, int]:
        """What the kernel told of a sample, which it goes on with where it has stopped for more room."""
        while found[1] == kernel.FULL:
            self.enlarge(2 * self.size.K)
            found = kernel.take(self.address, eps, kernel.UNLIMITED)
        return found

    def solve(self, task: int, start: int, stop: int, limit: int) -> tuple[int, int]:
        """`kernel.solve`, with as much room for bases as it needs: the same call goes on from the program that does."""
        while (found := kernel.solve(self.address, task, start, stop, limit))[0] == kernel.FULL:
            self.enlarge(2 * self.size.K)
        return found

    def enlarge(self, basis: int) -> None:
        """Room for larger bases; where the machine has none, programs stop at the largest that fit."""
        smaller, self.size = self.block, self.size._replace(K=min(basis, self.largest_basis))
        try:
            _check_room(self.size)
            self.block = kernel.allocate(self.size)
        except (MemoryError, ValueError):
            self.size = smaller.size
            self.arrays["clock"][kernel.CAPPED] = 1
            return
        self._name_arrays()
        _copy_leading(smaller.arrays, self.block.arrays)

    def check_whole(self) -> None:
        """Raise RuntimeError if an interruption has left the newest sample half taken, which another would mix with."""
        if self.arrays["clock"][kernel.STAGE]:
            raise RuntimeError("its last sample was interrupted; call reset(set), or go on from a saved state")

    def check_clock(self) -> None:
        """Raise ValueError unless the clock is one, and whatever else the kernel takes for an index is one too."""
        clock, base, time, steps = self.arrays["clock"], self.base, self.time, self.size.N
        flags = clock[[kernel.STARTED, kernel.PENDING]]
        counts = (clock >= 0) & (clock < _MOST_COUNTED)
        if not (0 <= base <= time <= base + steps and np.isin(flags, (0, 1)).all() and counts.all()):
            raise ValueError(f"its window holds samples {base} to {time}; expected at most {steps} steps from 0 on")
        if clock[[kernel.STAGE, kernel.NEXT]].any():
            raise ValueError("its newest sample is half taken; expected a state between two samples")
        seen = self.arrays["seen_base"]
        if ((seen < -1) | (seen > base)).any():
            raise ValueError(f"seen_base has an entry below -1 or above {base}, the oldest sample")
        ends = {"k": self.size.K, "rows": len(self.arrays["G"]), "cols": len(self.arrays["GT"]), "status": 4}
        for name, end in (ends | {"owner": self.size.ni}).items():
            if ((self.arrays[name] < 0) | (self.arrays[name] >= end)).any():
                raise ValueError(f"{name} has an entry below 0 or above {end - 1}")
        for name, array in self.kept.items():
            missing, open_ended = name in _MAY_MISS, name.endswith(_MAY_BE_OPEN)
            if not (np.isfinite(array) | (np.isnan(array) & missing) | (np.isinf(array) & open_ended)).all():
                raise ValueError(f"{name} contains NaN or Inf")


def _copy_leading(smaller: dict[str, NDArray[Any]], larger: dict[str, NDArray[Any]]) -> None:
    """Copy every array to the leading block of one that is larger."""
    for name, small in smaller.items():
        larger[name][tuple(slice(0, length) for length in small.shape)] = small


def _room_for(size: kernel.Sizes) -> kernel.Block:
    """The block of a window, or an error that names the horizon, also where the machine has no room for them."""
    _check_room(size)
    try:
        return kernel.allocate(size)
    except MemoryError as error:
        raise ValueError(f"horizon makes a window of {size.N} steps ({error}); expected a shorter one") from None


def _check_room(size: kernel.Sizes) -> None:
    """Refuse a window whose rows, which are kept twice, and bases no machine could hold, before they are allocated."""
    nv, nr = size.nw + size.nq, size.ny + size.nh + 2 * size.nq
    needed = 16 * (size.N + 1) * nr * (size.n + (size.N + 1) * nv)
    needed += 8 * (4 * size.nt + 2 * size.nq + 1) * size.K**2
    if needed > _MOST_BYTES:
        raise ValueError(
            f"horizon makes a window of {size.N:.3g} steps, whose rows take {needed / 2**30:.3g} GB; expected at most "
            f"{_MOST_BYTES // 2**30} GB: take a shorter one"
            if size.N < 2**500
            else "horizon is beyond all memory; expected a number of steps"
        )
