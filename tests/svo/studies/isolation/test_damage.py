"""Studies whose folders are damaged, copied, mixed or used by two: nothing counts twice, nothing is lost silently."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from svo.plant import load_plant
from svo.store import locked
from svo.store.packed_lines import members_of
from svo.studies.configuration import StudyConfiguration
from svo.studies.isolation.figures import write_pictures
from svo.studies.isolation.run import RunRow
from svo.studies.isolation.runner import run_study
from svo.studies.isolation.store import StudyFolder
from svo.studies.isolation.summary import summarise
from tests.svo.commands import svo

STUDY = ["study", "tank", "--runs", "1", "--seed", "3", "--workers", "1"]


def configuration() -> StudyConfiguration:
    return StudyConfiguration.for_plant(load_plant("tank"), runs=1, seed=3)


def untimed(folder: StudyFolder) -> list[RunRow]:
    return [replace(row, microseconds_per_step=0.0, microseconds_p99=0.0) for row in folder.rows()]


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished study of four runs, three of them with alarms."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(Path(__file__).parent / "registered"))
        return run_study(configuration(), tmp_path_factory.mktemp("finished") / "study").path


@pytest.fixture
def study(finished: Path, registered_tank: str, tmp_path: Path) -> StudyFolder:
    return StudyFolder(Path(shutil.copytree(finished, tmp_path / "study")))


def resumed(study: StudyFolder) -> list[tuple[int, int]]:
    """Runs done and runs in all, at the start of a resumed study and after each run."""
    calls: list[tuple[int, int]] = []
    run_study(configuration(), study.path, resume=True, progress=lambda *done: calls.append(done))
    return calls


def flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


@pytest.mark.parametrize(
    "damage",
    [flip, lambda path: path.write_bytes(path.read_bytes()[:-200]), lambda path: path.write_bytes(b""), Path.unlink],
)
def test_a_damaged_part_is_computed_again(study: StudyFolder, damage: Callable[[Path], Any]) -> None:
    rows, alarms = untimed(study), study.alarms.read_bytes()
    damage(study.parts / "run-000002.parquet")
    assert resumed(study) == [(3, 4), (4, 4)]
    assert untimed(study) == rows
    assert study.alarms.read_bytes() == alarms
    assert not (study.path / "alarms").exists()


def test_a_damaged_part_is_named_and_left_out_on_request(study: StudyFolder) -> None:
    rows = untimed(study)
    flip(study.parts / "run-000002.parquet")
    answer = svo("report", study.path)
    assert answer.exit_code == 1
    assert "run-000002.parquet: its checksum does not match" in answer.output
    assert "--resume" in answer.output
    assert "--without-damaged" in answer.output
    answer = svo("report", study.path, "--without-damaged")
    assert answer.exit_code == 0, answer.output
    assert "run-000002.parquet: its checksum does not match" in answer.output
    assert "3 runs" in (study.path / "report.html").read_text(encoding="utf-8")
    assert [row.run for row in study.rows(without_damaged=True)] == [rows[i].run for i in (0, 1, 3)]


def test_damaged_samples_are_named_left_out_on_request_and_computed_again(study: StudyFolder) -> None:
    sample = study.path / "exemplars" / "run-000001.npz"
    content = sample.read_bytes()
    flip(sample)
    with pytest.raises(ValueError, match=r"run-000001\.npz: missing, or its checksum"):
        study.exemplars()
    assert len(study.exemplars(without_damaged=True)) == 3
    assert resumed(study) == [(3, 4), (4, 4)]
    assert sample.read_bytes()[:100] == content[:100]
    assert len(study.exemplars()) == 4


def test_copies_and_strays_neither_count_nor_break_anything(study: StudyFolder) -> None:
    rows = untimed(study)
    part = (study.parts / "run-000001.parquet").read_bytes()
    for name in ("run-000099.parquet", "run-000001 copy.parquet", ".DS_Store", "run-000001.parquet~"):
        (study.parts / name).write_bytes(part)
    (study.parts / "run-000050.parquet").write_bytes(part[:-100])
    (study.path / "exemplars" / "run-000007.npz").write_bytes(b"")
    (study.path / ".DS_Store").write_bytes(b"")
    assert untimed(study) == rows
    answer = svo("report", study.path)
    assert answer.exit_code == 0, answer.output
    assert "run-000099.parquet is none of the study's runs; ignored" in answer.output
    assert ".DS_Store" not in answer.output
    assert resumed(study) == [(4, 4)]
    assert (study.parts / "run-000099.parquet").exists()


def test_alarms_of_another_command_are_never_taken_for_the_studys_own(study: StudyFolder) -> None:
    every, foreign = study.alarms.read_bytes(), next(members_of(study.alarms))[0]
    study.alarms.write_bytes(foreign)
    with pytest.raises(ValueError, match=r"alarms\.jsonl\.gz is not what this study wrote: .*--resume"):
        resumed(study)
    answer = svo(*STUDY, "--resume", "--out", study.path)
    assert answer.exit_code == 1
    assert "is not what this study wrote" in answer.output
    assert study.alarms.read_bytes() == foreign
    study.alarms.rename(study.path / "mine.jsonl")
    assert resumed(study)[0] == (1, 4)  # the runs whose alarms are gone are done again
    assert study.alarms.read_bytes() == every
    assert (study.path / "mine.jsonl").read_bytes() == foreign


def test_alarms_that_come_into_an_unfinished_study_stop_the_joining_and_lose_nothing(study: StudyFolder) -> None:
    every = study.alarms.read_bytes()
    (study.parts / "run-000003.parquet").unlink()

    def intrude(done: int, of: int) -> None:
        if done == of:
            study.alarms.write_bytes(b"foreign\n")

    with pytest.raises(ValueError, match="is not what this study wrote"):
        run_study(configuration(), study.path, resume=True, progress=intrude)
    assert study.alarms.read_bytes() == b"foreign\n"
    study.alarms.unlink()
    assert resumed(study) == [(4, 4)]
    assert study.alarms.read_bytes() == every


def test_a_link_in_the_place_of_the_alarms_is_not_followed(study: StudyFolder, tmp_path: Path) -> None:
    shutil.move(study.alarms, tmp_path / "elsewhere.jsonl")
    study.alarms.symlink_to(tmp_path / "elsewhere.jsonl")
    with pytest.raises(ValueError, match="is not what this study wrote"):
        resumed(study)


def test_files_of_others_in_the_folder_of_alarms_stay(study: StudyFolder) -> None:
    (study.parts / "run-000002.parquet").unlink()
    (study.path / "alarms").mkdir()
    (study.path / "alarms" / "remarks.txt").write_text("mine")
    resumed(study)
    assert [path.name for path in (study.path / "alarms").iterdir()] == ["remarks.txt"]


def test_two_processes_do_not_work_in_one_folder(study: StudyFolder) -> None:
    with locked(study.path):
        with pytest.raises(ValueError, match="is in use by process"):
            resumed(study)
        answer = svo(*STUDY, "--resume", "--out", study.path)
        assert answer.exit_code == 1
        assert "is in use by process" in answer.output
        assert svo("report", study.path).exit_code == 0  # a study that is running can be looked at


def test_reports_are_not_written_through_links(study: StudyFolder, tmp_path: Path) -> None:
    names = ("report.html", "summary.csv", "delays_calm.png")
    for name in names:
        (tmp_path / name).write_text("mine")
        (study.path / name).unlink(missing_ok=True)
        (study.path / name).symlink_to(tmp_path / name)
    assert svo("report", study.path).exit_code == 0
    assert [(tmp_path / name).read_bytes() for name in names] == [b"mine"] * 3


def test_a_noise_set_named_like_a_path_names_no_picture_outside(study: StudyFolder, tmp_path: Path) -> None:
    noise = "../../x"
    plant = replace(load_plant("tank"), noise_sets=(noise,))  # type: ignore[type-var]
    summaries = summarise([replace(row, noise=noise) for row in study.rows()])
    folder = tmp_path / "a" / "b"
    folder.mkdir(parents=True)
    pictures = write_pictures(folder, plant, summaries, [replace(e, noise=noise) for e in study.exemplars()])
    assert {picture.path.resolve().parent for picture in pictures} == {folder.resolve()}
    assert sorted(folder.iterdir()) == sorted(picture.path for picture in pictures)


def change(**changes: Any) -> Callable[[str], str]:
    return lambda text: json.dumps({k: v for k, v in (json.loads(text) | changes).items() if v is not None})


def change_configuration(**changes: Any) -> Callable[[str], str]:
    def changed(text: str) -> str:
        stored = json.loads(text)
        stored["configuration"] = {k: v for k, v in (stored["configuration"] | changes).items() if v is not None}
        return json.dumps(stored)

    return changed


@pytest.mark.parametrize(
    ("edit", "expected"),
    [
        (lambda text: "", "it is no JSON"),
        (lambda text: text[: len(text) // 2], "it is no JSON"),
        (lambda text: "[" * 100_000, "it is no JSON"),
        (lambda text: "[]", "expected an object with a configuration"),
        (lambda text: "{}", "expected an object with a configuration"),
        (change(configuration={}), "the configuration lacks 'architectures'"),
        (change(configuration=[]), "expected an object with a configuration"),
        (change(versions=None), "versions is no object of texts"),
        (change(runs="four"), "runs is 'four', expected how many there are"),
        (change(format=None), "has the format None, that of another version"),
        (change(format="svo-study-9"), "has the format 'svo-study-9', that of another version"),
        (change_configuration(plant=None), "the configuration lacks 'plant'"),
        (change_configuration(plant=7), "plant of the configuration is 7; expected a text"),
        (change_configuration(runs="ten"), "runs of the configuration is 'ten'; expected an integer"),
        (change_configuration(runs=-1), "runs is -1"),
        (change_configuration(seed=True), "seed of the configuration is True; expected an integer"),
        (change_configuration(noise="calm"), "noise of the configuration is 'calm'; expected a list of texts"),
        (change_configuration(plant="unheard"), "no plant is registered as 'unheard'"),
        (change_configuration(colour="red"), "has the unknown key 'colour'"),
        (change_configuration(seed=4), "holds no finished run"),
    ],
)
def test_a_study_that_says_nonsense_about_itself_is_one_clear_error(
    study: StudyFolder, edit: Callable[[str], str], expected: str
) -> None:
    identity = study.path / "study.json"
    identity.write_text(edit(identity.read_text(encoding="utf-8")), encoding="utf-8")
    answer = svo("report", study.path)
    assert answer.exit_code == 1
    assert expected in " ".join(answer.output.split())
    assert answer.output.count("\n") == 1
    answer = svo(*STUDY, "--resume", "--out", study.path)
    assert answer.exit_code == 1
    assert answer.output.splitlines()[-1].startswith("error: ")
