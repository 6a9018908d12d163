"""Files, dicts and constraints: what goes out comes back exactly, and other libraries understand it."""

import importlib.util
import json
import sys
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from exact_sets import polyhedron
from scipy.optimize import milp
from sets import CATALOGUE, EMPTY, UNBOUNDED

from polytopes import HPolytope, UnboundedError, conversions
from polytopes.files import read_ext, read_ine, write_ext, write_ine
from polytopes.planar import is_convex_ring, outline

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
        ("begin\n1 2 real\n1 1e-400\nend", "row 1 has a number beyond all floats"),
        ("begin\n1 2 real\n1 1e999999999999\nend", "is beyond all floats"),
        ("begin\n1 2 integer\n1 1 5\nend", "more than 1 rows of 2 numbers"),
        ("begin\n1 2 integer\n1 1\n1 5\nend", "more than 1 rows of 2 numbers"),
        ("begin\n-1 2 integer\nend", "it says -1 rows of 2 numbers"),
        ("linearity 1 2\nbegin\n1 2 integer\n1 1\nend", "linearity names row 2 of 1"),
        ("linearity 2 1\nbegin\n1 2 integer\n1 1\nend", "linearity names 1 rows, and says 2"),
    ],
)
def test_wrong_files_are_refused(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "set.ine"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        read_ine(path)


EXTREME = [
    HPolytope([[1.0, 0.0], [0.0, -1e-300]], [1e-300, 0.1]),
    HPolytope([[1.0, 1e-300], [2.0**-1074, 3.0]], [1e300, 2.0**1023], [[1e308, -(2.0**-1022)]], [5e-324]),
    HPolytope([[1e-200, 1e150]], [0.3]),
]


@pytest.mark.parametrize("P", EXTREME)
def test_the_longest_numbers_come_back(P: HPolytope, tmp_path: Path) -> None:
    path = tmp_path / "set.ine"
    write_ine(P, path)
    again = read_ine(path)
    for rows, sides, given, values in ((again.A, again.b, P.A, P.b), (again.C, again.d, P.C, P.d)):
        for row, whole in zip(np.column_stack([rows, sides]), np.column_stack([given, values]), strict=True):
            factors = {Fraction(u) / Fraction(v) for u, v in zip(row.tolist(), whole.tolist(), strict=True) if v}
            assert len(factors) == 1
            assert factors.pop() > 0
            assert ((row == 0.0) == (whole == 0.0)).all()
    others = [HPolytope.from_dict(P.to_dict())]
    if "cdd" in sys.modules or importlib.util.find_spec("cdd"):
        others.append(conversions.from_cdd(conversions.to_cdd(P)))
    for other in others:
        for part, given in zip(other.table, P.table, strict=True):
            np.testing.assert_array_equal(part, given)


def test_real_numbers_of_a_file_are_the_nearest_floats_where_they_are_no_others(tmp_path: Path) -> None:
    path, A = tmp_path / "set.ine", np.random.default_rng(1).standard_normal((5, 3))
    rows = "\n".join(" ".join(f"{v:.16e}" for v in [1.0, *(-row)]) for row in A)
    path.write_text(f"* données\nbegin\n5 4 real\n{rows}\nend\n", "latin-1")
    np.testing.assert_array_equal(read_ine(path).A, A)
    path.write_text("begin\n1 2 real\n1 -0.1\nend")
    assert read_ine(path) == HPolytope([[1.0]], [10.0])


def test_matrices_of_fractions_are_exact() -> None:
    cdd = pytest.importorskip("cdd")
    matrix = SimpleNamespace(
        rep_type=cdd.RepType.INEQUALITY, array=[[Fraction(1, 3), -1], [Fraction(1, 7), 2]], lin_set={1}
    )
    P = conversions.from_cdd(matrix)
    np.testing.assert_array_equal(P.A, [[3.0]])
    np.testing.assert_array_equal(P.C, [[-14.0]])


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


def test_shapely_of_very_uneven_sets() -> None:
    shapely = pytest.importorskip("shapely")
    for P in (HPolytope.box([0.0, 0.0], [1e-140, 1e140]), HPolytope.box([1.0, 0.0], [1.0 + 2.0**-52, 1e-120])):
        assert conversions.from_shapely(conversions.to_shapely(P)) == P
    ring = shapely.Polygon([(0, 0), (4, 0), (4, 4), (0, 4)], [[(1, 1), (2, 1), (1, 2)]])
    with pytest.raises(ValueError, match="not convex"):
        conversions.from_shapely(ring)


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


def test_outlines_and_convex_rings_are_decided_in_rationals() -> None:
    thin = np.array([[0.0, 0.0], [1e100, 1e-200], [2e100, 2e-200], [2e100, 5e-200], [0.0, 1e-320]])
    np.testing.assert_array_equal(outline(thin[::-1]), thin[[0, 2, 3, 4]])
    np.testing.assert_array_equal(outline(np.array([[2.0, 2.0], [1.0, 1.0], [3.0, 3.0]])), [[1.0, 1.0], [3.0, 3.0]])
    np.testing.assert_array_equal(outline(np.array([[2.0, 2.0]] * 3)), [[2.0, 2.0]])
    assert outline(np.empty((0, 2))).size == 0
    ring = thin[[0, 0, 1, 2, 3, 4, 0]]
    for some in (ring, ring[::-1], np.roll(ring[1:-1], 2, axis=0)[[0, 1, 2, 3, 4, 0]]):
        assert is_convex_ring(some)
    dented = thin[[0, 1, 2, 3, 4, 0]].copy()
    dented[1, 1] = np.nextafter(dented[1, 1], 1.0)  # the second corner a little inside
    assert not is_convex_ring(dented)
    star = np.array([[np.cos(t), np.sin(t)] for t in 0.8 * np.pi * np.arange(6)])
    star[-1] = star[0]
    assert not is_convex_ring(star)  # turns left everywhere, and twice around
    assert not is_convex_ring(np.array([[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]]))  # there and back
