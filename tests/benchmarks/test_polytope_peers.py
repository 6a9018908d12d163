"""The comparison of operations on sets: what it calls right is right, what is not it calls wrong, and it resumes."""

import json

import numpy as np
import pytest

pytest.importorskip("ppl", reason="the exact answers come from pplpy")

from benchmarks import _set_instances as instances
from benchmarks import _set_peers as peers
from benchmarks import polytope_peers
from benchmarks._set_truth import judge

CASES = [instances.small()[2], instances.decimal()[0]]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
@pytest.mark.parametrize("operation", peers.OURS)
def test_our_answers_and_the_exact_library_s_are_right(operation, case):
    right = judge(operation, case)
    assert right(peers.OURS[operation](case))
    assert operation not in peers.PARMA or right(peers.PARMA[operation](case))


@pytest.mark.parametrize("operation", peers.OURS)
def test_an_answer_that_is_off_is_wrong(operation):
    case = CASES[0]
    answer = peers.OURS[operation](case)
    answer = peers.rows_of(answer) if hasattr(answer, "A") else answer
    other = not answer if isinstance(answer, bool) else [*answer] if isinstance(answer, tuple) else answer * 1.0
    if isinstance(other, list):
        other[1] = other[1] + 1e-6
    elif isinstance(other, float):
        other += 1e-6
    elif isinstance(other, np.ndarray):
        other[0, -1] -= 1e-6
    assert not judge(operation, case)(other)


def test_a_vertex_that_is_missing_or_a_row_too_many_is_wrong():
    case = CASES[1]
    vertices = peers.OURS["vertices"](case)
    assert not judge("vertices", case)(vertices[1:])
    assert not judge("vertices", case)(np.vstack([vertices, vertices[:1]]))
    rows = peers.rows_of(peers.OURS["redundancy"](case))
    assert not judge("redundancy", case)(rows[1:])
    assert not judge("redundancy", case)(np.vstack([rows, rows.mean(axis=0)]))


def test_lines_that_are_done_are_not_measured_again(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(polytope_peers, "times", lambda methods, case: dict.fromkeys(methods, 1.0))
    wanted = ["--out", str(tmp_path), "--only", "emptiness, interval"]
    polytope_peers.main(wanted)
    (line,) = (tmp_path / "polytope_peers.jsonl").read_text().splitlines()
    assert json.loads(line)["microseconds"]["ours"] == 1.0
    monkeypatch.setattr(polytope_peers, "measure", lambda operation, case: pytest.fail("measured again"))
    polytope_peers.main(wanted)
    assert "| emptiness | 1, 1 S |" in (tmp_path / "polytope_peers.md").read_text()
    assert "1 lines" in capsys.readouterr().out
