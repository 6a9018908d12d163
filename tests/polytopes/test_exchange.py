"""Files, dicts and constraints: what goes out comes back exactly, and other libraries understand it."""

import json
from pathlib import Path

import numpy as np
import pytest
from exact_sets import polyhedron
from scipy.optimize import milp
from sets import CATALOGUE, EMPTY, UNBOUNDED

from polytopes import HPolytope, UnboundedError, conversions
from polytopes.files import read_ext, read_ine, write_ext, write_ine

EVERY = pytest.mark.parametrize("name", CATALOGUE)


@EVERY
def test_files_of_rows_keep_every_number(name: str, tmp_path: Path) -> None:
    P, path = CATALOGUE[name], tmp_path / "set.ine"
    write_ine(P, path)
    again = read_ine(path)
    assert polyhedron(again) == polyhedron(P)
    assert (again.b.size, again.d.size) == (P.b.size, P.d.size)
    text = path.read_text()
    assert text.startswith("H-representation\n")
    assert f"begin\n{P.b.size + P.d.size} {P.dim + 1} integer\n" in text


@EVERY
def test_files_of_generators_keep_the_set(name: str, tmp_path: Path) -> None:
    P, path = CATALOGUE[name], tmp_path / "set.ext"
    write_ext(P, path)
    again = read_ext(path)
    assert again.is_empty() == (name in EMPTY)
    if name != "decimal ray":  # a line of so many bits that no float is along it
        assert again >= P
        assert again.contains(P)
    if name not in ("decimal ray", "slice", "scaled rows"):
        assert again == P


@pytest.mark.parametrize("name", [name for name in CATALOGUE if name not in EMPTY | UNBOUNDED])
def test_we_read_what_cdd_writes(name: str, tmp_path: Path) -> None:
    cdd = pytest.importorskip("cdd")
    P, path = CATALOGUE[name], tmp_path / "set.ext"
    path.write_text(str(cdd.copy_generators(cdd.polyhedron_from_matrix(conversions.to_cdd(P)))))
    assert read_ext(path).equals(P, tol=1e-6)


def test_a_file_of_another_hand(tmp_path: Path) -> None:
    path = tmp_path / "set.ine"
    path.write_text("* a square cut by x = y/3\nH-representation\nlinearity 1  5\nbegin\n 5 3 rational\n"
                    "1/3 -1 0\n 1 0 -1 0 1 0\n0 0 1\n0 -1 1/3\nend\nmaximize 0 1 1\n")  # fmt: skip
    P = read_ine(path)
    assert (P.b.size, P.d.size) == (4, 1)
    assert [1 / 4, 3 / 4] in P
    assert HPolytope([[3, 0], [0, 1], [-1, 0], [0, -1]], [1, 1, 0, 0], [[3, -1]], [0]) == P
    path.write_text("V-representation\nbegin\n3 3 real\n1 0.5 0\n1 0 1e-1\n0 1 1\nend\n")
    assert read_ext(path).contains([[0.5, 0.0], [0.0, 0.1], [10.5, 10.0]], tol=0.0).all()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "it ends before its rows do"),
        ("begin\n2 2 integer\n1 1\n", "it ends before its rows do"),
        ("begin\n1 2 integer\n1 one\nend", "no file of cddlib"),
        ("begin\n1 2 rational\n1 1/0\nend", "no file of cddlib"),
        ("V-representation\nbegin\n1 2 integer\n1 1\nend", "is a V-representation; expected a H-representation"),
        (f"begin\n1 2 integer\n1 {3**40}\nend", "row 1 is no multiple of floats"),
    ],
)
def test_wrong_files_are_refused(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "set.ine"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        read_ine(path)


def test_wrong_generators_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "set.ext"
    path.write_text("V-representation\nbegin\n1 2 integer\n2 1\nend")
    with pytest.raises(ValueError, match="row 1 begins with 2"):
        read_ext(path)


@EVERY
def test_dicts_keep_every_number(name: str) -> None:
    P = CATALOGUE[name]
    again = HPolytope.from_dict(json.loads(json.dumps(P.to_dict())))
    for one, other in zip(P.table, again.table, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"A": [["1/3", 0]]}, "'1/3', which no float equals"),
        ({"A": [["x", 0]]}, "'x'; expected a number"),
        ({"A": [[1]]}, "rows of other lengths; expected 2"),
        ({"b": None}, "not all of dim, A, b, C, d"),
        ({"dim": 0}, "dim'\\] is 0"),
    ],
)
def test_wrong_dicts_are_refused(change: dict, message: str) -> None:
    data = {**HPolytope([[1.0, 2.0]], [3.0]).to_dict(), **change}
    with pytest.raises(ValueError, match=message):
        HPolytope.from_dict({key: value for key, value in data.items() if value is not None})


@EVERY
def test_scipy_and_cvxpy_take_a_set_as_constraints(name: str) -> None:
    cp = pytest.importorskip("cvxpy")
    P = CATALOGUE[name]
    c = np.random.default_rng(3).standard_normal(P.dim)
    x = cp.Variable(P.dim)
    problem = cp.Problem(cp.Maximize(c @ x), P.to_cvxpy(x))
    value = problem.solve(solver=cp.HIGHS) if P.b.size + P.d.size else np.inf
    assert value == pytest.approx(P.support(c), abs=1e-6, rel=1e-6)
    found = milp(-c, constraints=P.to_linear_constraint(), bounds=(-np.inf, np.inf))
    assert found.success == (name not in EMPTY and np.isfinite(P.support(c)))
    if found.success:
        assert -found.fun == pytest.approx(P.support(c), abs=1e-6, rel=1e-6)
    with pytest.raises(ValueError, match="x has shape"):
        P.to_cvxpy(cp.Variable(P.dim + 1))


@pytest.mark.parametrize("name", [name for name in CATALOGUE if CATALOGUE[name].dim == 2])
def test_shapely(name: str) -> None:
    pytest.importorskip("shapely")
    P = CATALOGUE[name]
    if name in UNBOUNDED:
        with pytest.raises(UnboundedError):
            conversions.to_shapely(P)
        return
    geometry = conversions.to_shapely(P)
    assert geometry.is_empty == (name in EMPTY)
    assert geometry.area == pytest.approx(P.volume(), abs=1e-15)
    assert conversions.from_shapely(geometry).equals(P)


def test_what_shapely_cannot_hold_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "shapely", None)
    with pytest.raises(ImportError, match="pip install shapely"):
        conversions.to_shapely(CATALOGUE["square"])
    monkeypatch.undo()
    shapely = pytest.importorskip("shapely")
    with pytest.raises(ValueError, match="P has dimension 3"):
        conversions.to_shapely(CATALOGUE["cube"])
    corner = shapely.Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    with pytest.raises(ValueError, match="not convex"):
        conversions.from_shapely(corner)
