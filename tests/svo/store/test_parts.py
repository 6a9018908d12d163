"""Part files: what is written comes back, and no changed byte, cut or copy passes for a part."""

from __future__ import annotations

import random
from dataclasses import dataclass
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from svo.store import Parts, make_folder
from svo.store.seal import read_seal
from svo.store.tables import Format, Json, Parquet


@dataclass(frozen=True)
class Weighing:
    run: int
    scale: str
    grams: float | None
    counts: tuple[int, ...]
    fine: bool


ROWS = [Weighing(3, "left \N{GREEK SMALL LETTER MU}", 0.1, (1, 2), True), Weighing(3, "right", None, (), False)]
FORMATS = pytest.mark.parametrize("format", [Parquet(), Json()], ids=["parquet", "json"])


def parts(folder: Path, format: Format, study: str = "a") -> Parts[Weighing]:
    made = Parts(folder, Weighing, study, format)
    make_folder(made.folder)
    return made


@FORMATS
def test_rows_come_back_in_the_order_of_the_runs(format: Format, tmp_path: Path) -> None:
    folder = parts(tmp_path / "parts", format)
    folder.write(12, ROWS[1:], {"alarms": "0" * 64})
    folder.write(3, ROWS)
    assert folder.rows([3, 12]) == [*ROWS, ROWS[1]]
    assert folder.survey().intact[12].attached == {"alarms": "0" * 64}


@FORMATS
def test_every_flipped_bit_and_every_cut_is_found(format: Format, tmp_path: Path) -> None:
    folder = parts(tmp_path / "parts", format)
    folder.write(3, ROWS)
    path, rng = folder.path(3), random.Random(0)
    content = path.read_bytes()
    for bit in rng.sample(range(8 * len(content)), 400):
        changed = bytearray(content)
        changed[bit // 8] ^= 1 << bit % 8
        with pytest.raises(ValueError, match="changed"):
            read_seal(bytes(changed))
    for end in [0, 1, len(content) - 1, *rng.sample(range(len(content)), 50)]:
        path.write_bytes(content[:end])
        assert list(folder.survey().damaged) == [3]
    path.write_bytes(content + b"\n")
    assert list(folder.survey().damaged) == [3]
    path.write_bytes(content)
    assert list(folder.survey().intact) == [3]


def test_copies_strangers_and_hidden_files_are_no_parts(tmp_path: Path) -> None:
    folder, other = parts(tmp_path / "parts", Parquet()), parts(tmp_path / "other", Parquet(), study="b")
    folder.write(3, ROWS)
    other.write(4, ROWS)
    copy = folder.path(3).read_bytes()
    for name in ("run-000003 (1).parquet", "run-3.parquet", "run-000099.parquet", ".run-000003.parquet.swp"):
        (folder.folder / name).write_bytes(copy)
    (folder.folder / "run-000004.parquet").write_bytes(other.path(4).read_bytes())
    (folder.folder / ".DS_Store").write_bytes(b"\0\0\0\1Bud1")
    (folder.folder / "notes.txt~").write_text("mine")
    survey = folder.survey()
    assert list(survey.intact) == [3]
    assert survey.damaged == {}
    assert {path.name: why for path, why in survey.strays.items()} == {
        "run-000003 (1).parquet": "not the name of a part",
        "run-3.parquet": "not the name of a part",
        "run-000099.parquet": "a copy of the part of run 3",
        "run-000004.parquet": "a part of another study",
        "notes.txt~": "not the name of a part",
    }


def test_something_that_is_no_file_in_a_parts_place_is_damage(tmp_path: Path) -> None:
    folder = parts(tmp_path / "parts", Parquet())
    folder.path(7).mkdir()
    (folder.folder / "run-000008.parquet").symlink_to("nowhere")
    assert list(folder.survey().damaged) == [7, 8]


def test_other_readers_find_checksums_of_pages_too(tmp_path: Path) -> None:
    folder = parts(tmp_path / "parts", Parquet())
    folder.write(3, ROWS)
    assert pq.read_table(folder.path(3), page_checksum_verification=True).num_rows == 2
    content = folder.path(3).read_bytes()
    at = content.index(b"left")
    folder.path(3).write_bytes(content[:at] + b"Left" + content[at + 4 :])
    with pytest.raises(OSError, match="CRC"):
        pq.read_table(folder.path(3), page_checksum_verification=True)


def test_a_folder_elsewhere_is_refused(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "parts").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(ValueError, match="is a symbolic link"):
        parts(tmp_path / "parts", Parquet())
