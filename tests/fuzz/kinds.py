"""The kinds of input that are fuzzed: each a function of a generator and an empty folder that tries one case.

A case ends silently, or with an error that `tests.fuzz.outcome` judges. Oracles are in the functions: what is accepted
must be right.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.fuzz import files, programs, records, values

Case = Callable[[np.random.Generator, Path], None]

KINDS: dict[str, tuple[Case, int]] = {
    "api calls": (values.call, 3000),
    "descriptions": (files.description, 1500),
    "csv logs": (files.csv_log, 1500),
    "mat files": (files.mat_file, 900),
    "parquet logs": (files.parquet_log, 600),
    "alarm files": (records.alarms, 800),
    "saved states": (records.state, 700),
    "study folders": (records.study, 200),
    "options": (programs.options, 500),
    "commands": (programs.command, 300),
}
"""Each with its share of 10,000 cases."""
