"""Compiled kernel of the moving-horizon window: the observers and their proofs use it, nothing outside `svo.observers`.

memory        every array of a window, and its compiled type
factors      an uncertainty as a sum of channels, and what that leaves out
rows, channels, motion      the window's rows, its channels of uncertainty, and how it slides
basis, ratio_test, dual_simplex      the bounded dual simplex
programs, sample, older_rows      what Python calls: the programs of a window, one sample of data, rows added later
"""

from svo.observers.window_kernel.factors import channel_count, channel_factors
from svo.observers.window_kernel.memory import (
    BASE,
    CONSISTENT,
    EMPTY_CANDIDATE,
    LARGEST,
    PENDING,
    PIVOT_LIMIT,
    PIVOTS,
    PROGRAMS,
    REFACTORED,
    STARTED,
    STOPS,
    TIME,
    UNDECIDED,
    Sizes,
    allocate,
    new_window,
)
from svo.observers.window_kernel.older_rows import add_late, redraw_channel
from svo.observers.window_kernel.programs import ALL, ARRIVAL, CHANNELS, NEWEST, QUERY, arrival_programs, solve
from svo.observers.window_kernel.sample import (
    BAD_INPUT,
    BAD_MATRIX,
    BAD_OUTPUT,
    FINE,
    OUTGROWN,
    RANK_ROSE,
    SIGN_OPEN,
    complete,
    enter,
    initialise,
    move,
    take,
)

__all__ = [
    "ALL",
    "ARRIVAL",
    "BAD_INPUT",
    "BAD_MATRIX",
    "BAD_OUTPUT",
    "BASE",
    "CHANNELS",
    "CONSISTENT",
    "EMPTY_CANDIDATE",
    "FINE",
    "LARGEST",
    "NEWEST",
    "OUTGROWN",
    "PENDING",
    "PIVOTS",
    "PIVOT_LIMIT",
    "PROGRAMS",
    "QUERY",
    "RANK_ROSE",
    "REFACTORED",
    "SIGN_OPEN",
    "STARTED",
    "STOPS",
    "TIME",
    "UNDECIDED",
    "Sizes",
    "add_late",
    "allocate",
    "arrival_programs",
    "channel_count",
    "channel_factors",
    "complete",
    "enter",
    "initialise",
    "move",
    "new_window",
    "redraw_channel",
    "solve",
    "take",
]
