"""Mistakes in a `[log]` table are one error that names file, table and key."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from svo.plant.description.log import ALL_KEYS
from tests.svo.logs.dialect.carts import cart

TIME = 'time = { column = "t" }\n'


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("[log]\nseperator = ';'", ["[log]", "'seperator'", "'separator'"]),
        ("[log]\nseparator = ';;'", ["'separator'", "one character"]),
        ("[log]\ndecimal = ';'", ["'decimal'", 'expected "." or ","']),
        ("[log]\nseparator = ';'\ndecimal = ','\nthousands = ','", ["'thousands'", "as decimal is"]),
        ("[log]\nencoding = 'latin9000'", ["'encoding'", "cp1252"]),
        ("[log]\nheader = 0", ["'header'", "from 1 on"]),
        ("[log]\nheader = 3\nfirst_row = 2", ["'first_row'", "behind header"]),
        ("[log]\nheader = 3\nnames = ['a']", ["'names'", "header"]),
        ("[log]\nskip = ['(']", ["'skip'", "regular expression"]),
        ("[log]\nskip = '#'", ["'skip'", "list of texts"]),
        ("[log]\nmissing = [1]", ["'missing'", "list of texts"]),
        ("[log]\nsentinels = ['x']", ["'sentinels'", "numbers"]),
        ("[log]\nvalid = { column = 'ok' }", ["[log.valid]", "'good'"]),
        ("[log]\ntime = { column = 't', step = 0.1 }", ["[log.time]", "either column, or start and step"]),
        ("[log]\ntime = { start = 0 }", ["[log.time]", "either column, or start and step"]),
        ("[log]\nseparator = 'a'", ["'separator'", "no part of"]),
        ("[log]\nseparator = '\"'", ["'separator'", "no part of"]),
        ("[log]\nthousands = '1'", ["'thousands'", "no part of"]),
        ("[log]\nexponent = '5'", ["'exponent'", "a letter such as D"]),
        ("[log]\ntime = { column = 't', start = 0 }", ["'start'", "so is column"]),
        ("[log]\ntime = { step = 100, unit = 'ms' }", ["'unit'", "step", "in seconds"]),
        ("[log]\ntime = { step = 0.1, epoch = 1970-01-01 }", ["'epoch'", "step"]),
        ("[log]\ntime = { step = 0.1, format = 'iso' }", ["'format'", "step"]),
        ("[log]\ntime = { step = inf }", ["'step'", "seconds from row to row"]),
        ("[log]\ntime = { step = 1e-20 }", ["'step'", "seconds from row to row"]),
        ("[log]\ntime = { step = 0.1, start = inf }", ["'start'", "or a date"]),
        ("[log]\ntime = { step = 0.1, start = 10:15:00 }", ["'start'", "2025-03-14T10:15:00"]),
        ("[log]\ntime = { step = 0.1, zone = 'UTC' }", ["'zone'", "is for dates"]),
        ("[log]\ntime = { column = 't', format = 'duration', zone = 'UTC' }", ["'zone'", "is for dates"]),
        ("[log]\ntime = { column = 't', format = '%H:%M', zone = 'UTC' }", ["'zone'", "the day too"]),
        ("[log]\ntime = { column = 't', format = '%Q' }", ["'format'", "'Q' is a bad directive"]),
        ("[log]\ntime = { column = 't', format = '%H%' }", ["'format'", "stray %"]),
        ("[log]\ntime = { start = 0, step = 0 }", ["'step'", "above 0"]),
        ("[log]\ntime = { column = 't', unit = 'min.' }", ["'unit'", "100ns", "day"]),
        ("[log]\ntime = { column = 't', format = 'ISO' }", ["'format'", '"iso"']),
        ("[log]\ntime = { column = 't', format = 'iso', unit = 's' }", ["'format'", "drop one"]),
        ("[log]\ntime = { column = 't', zone = 'Berlin' }", ["'zone'", "Europe/Berlin"]),
        ("[log]\ntime = { column = [] }", ["'column'", "empty list"]),
        ("[log]\ntime = { column = 0 }", ["'column'", "from 1 on"]),
        ("[log]\ntime = { column = 't', epoch = 5 }", ["'epoch'", "date"]),
        ("[log]\nlong = { tag = 'a' }", ["[log.long]", "'value'"]),
        ("[log]\nduplicates = 'drop'", ["'duplicates'", "first, last, mean"]),
        ("[log]\norder = 'any'", ["'order'", "sort"]),
        ("[log]\norder = 'sort'\npart = 1", ["'order'", "part"]),
        ("[log.columns.speed]\ncolumn = 'v'", ["[log.columns]", "'speed'", "force, position"]),
        ("[log.columns.position]\ntag = 'x'", ["'tag'", "long"]),
        ("[log]\nlong = { tag = 'a', value = 'b' }\n[log.columns.force]\ncolumn = 'x'", ["'column'", "expected tag"]),
        ("[log.columns.position]\nmissing = 'hold'", ["'missing'", "for inputs"]),
        ("[log.columns.force]\nrate = 1.0", ["'rate'", "never moved"]),
        ("[log.columns.force]\nheld = 1.0", ["'held'", "hold"]),
        ("[log.columns.force]\nresolution = 1.0", ["'resolution'", "exact"]),
        ("[log.columns.position]\nrate = -1.0", ["'rate'", "> 0"]),
        ("[log.columns.position]\nscale = 0", ["'scale'", "not 0"]),
        ("[log.columns.position]\nnumber = 'hex12'", ["'number'", "hex16"]),
        ("[log.columns.position]\nfile = '../x.csv'", ["'file'", "beside"]),
        ("[log.columns.position]\nunits = 'mm'", ["'units'", "'unit'"]),
    ],
)
def test_a_mistake_names_its_key(table: str, words: list[str], tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"my_cart\.toml, \[log") as caught:
        cart(tmp_path, table + "\n")
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)


def test_an_empty_table_reads_the_plain_columns(tmp_path: Path) -> None:
    plant = cart(tmp_path, "[log]\n")
    assert plant.dialect is not None
    assert plant.dialect.channel("force").column is None


def test_without_the_table_logs_are_plain_ones(tmp_path: Path) -> None:
    assert cart(tmp_path, "").dialect is None


LOGS = (Path(__file__).parents[4] / "docs" / "logs.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^```toml\n(\[log\].*?)^```", LOGS, re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("table", EXAMPLES)
def test_the_tables_of_the_page_are_tables(table: str, tmp_path: Path) -> None:
    assert cart(tmp_path, table).dialect is not None


def test_the_page_has_every_key() -> None:
    assert not [
        key for key in ALL_KEYS if f"`{key}`" not in LOGS and f"`{key} = " not in LOGS and f"[log.{key}" not in LOGS
    ]
    assert EXAMPLES
