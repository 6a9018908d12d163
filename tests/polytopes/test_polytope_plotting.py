"""Pictures: each kind of set gives artists that show it."""

import matplotlib
import numpy as np
import pytest
from sets import CATALOGUE, EMPTY

from polytopes import HPolytope
from polytopes.plotting import shadow

matplotlib.use("Agg")
import matplotlib.pyplot as plt


@pytest.mark.parametrize("name", [name for name, P in CATALOGUE.items() if P.dim >= 2])
def test_every_kind_of_set_can_be_drawn(name: str) -> None:
    figure, ax = plt.subplots()
    artists = CATALOGUE[name].plot(ax=ax, color="tab:blue")
    assert len(artists) == (0 if name in EMPTY else 1)
    figure.canvas.draw()
    plt.close(figure)


def test_shadow_of_a_turned_cube_has_the_support_of_the_cube() -> None:
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.standard_normal((4, 4)))[0]
    P = HPolytope.box(-np.ones(4), np.ones(4)).preimage(turn)
    outline = shadow(P, (1, 3))
    assert len(outline) == 8  # a projected 4-cube is a zonotope of four generators
    c = rng.standard_normal((50, 2))
    lifted = np.zeros((50, 4))
    lifted[:, [1, 3]] = c
    np.testing.assert_allclose((outline @ c.T).max(axis=0), P.support(lifted), atol=1e-12)
    edges = np.roll(outline, -1, axis=0) - outline
    turns = edges[:, 0] * np.roll(edges[:, 1], -1) - edges[:, 1] * np.roll(edges[:, 0], -1)
    assert (turns > 0.0).all()


@pytest.mark.parametrize("name", [name for name, P in CATALOGUE.items() if P.dim == 2])
@pytest.mark.parametrize("height", [0.0, 1.0, np.inf])
def test_every_kind_of_set_can_be_drawn_in_space(name: str, height: float) -> None:
    prism = CATALOGUE[name].product(HPolytope.box([0.0], [height]))
    artists = prism.plot(dims=(0, 1, 2), color="tab:blue")
    assert len(artists) == (0 if name in EMPTY else 1)
    plt.gcf().canvas.draw()
    plt.close("all")


def test_what_pads_faces_with_few_corners_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """Matplotlib fills its table of faces with whatever is in memory, and its own limits overflow on some of that."""
    prism = HPolytope.from_vertices([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]).product(HPolytope.box([0.0], [1.0]))
    empty = np.empty

    def dirty(shape: object, dtype: object = float, **options: object) -> np.ndarray:
        table = empty(shape, dtype, **options)  # type: ignore[call-overload]
        if table.dtype.kind == "f":
            table.fill(-np.finfo(float).max)
        return table

    monkeypatch.setattr(np, "empty", dirty)
    prism.plot(dims=(0, 1, 2))
    low, high = plt.gca().get_xlim()
    plt.close("all")
    assert -0.2 < low <= 0.0
    assert 1.0 <= high < 1.2


def test_faces_of_a_cube() -> None:
    (solid,) = CATALOGUE["cube"].plot(dims=(2, 0, 1))
    faces = list(solid._faces)
    assert len(faces) == 6
    for face in faces:
        edges = np.roll(face, -1, axis=0) - face
        assert np.sort(np.count_nonzero(np.abs(edges) > 1e-12, axis=1)).tolist() == [1, 1, 1, 1]
    plt.close("all")


def test_dims_are_checked() -> None:
    with pytest.raises(ValueError, match="dims is"):
        CATALOGUE["cube"].plot(dims=(0, 3))
    with pytest.raises(ValueError, match="dims is"):
        CATALOGUE["cube"].plot(dims=(1, 1))


def test_axes_of_another_dimension_are_refused() -> None:
    plane, space = plt.figure().add_subplot(), plt.figure().add_subplot(projection="3d")
    for ax, dims, words in ((plane, (0, 1, 2), "ax has 2 dimensions"), (space, (0, 1), "ax has 3 dimensions")):
        for P in (CATALOGUE["cube"], CATALOGUE["cube"] | CATALOGUE["cube"]):
            with pytest.raises(ValueError, match=words):
                P.plot(ax, dims=dims)
    plt.close("all")


@pytest.mark.parametrize("scale", [[1e9, 1.0], [1.0, 1e9], [1e-6, 1e6], [1.0, 1.0]])
def test_axes_of_very_different_extent_show_every_vertex(scale):
    """A box of 1e9 by 1 was drawn as a line: points within 1e-9 of the larger extent were one."""
    turn = 2 * np.pi * np.arange(11) / 11
    points = np.column_stack([np.cos(turn), np.sin(turn)]) * scale
    figure, axes = plt.subplots(1, 2)
    (polygon,) = HPolytope.from_vertices(points).plot(ax=axes[0])
    assert 11 + 1 <= len(polygon.get_xy()) <= 11 + 5  # closed
    (box,) = HPolytope.box([0.0, 0.0], scale).plot(ax=axes[1])
    corners = {tuple(corner) for corner in (box.get_xy() / scale).round(6)}
    assert corners >= {(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)}  # a point along an edge does no harm
    plt.close(figure)


def test_flat_sets_stay_flat_beside_a_large_extent():
    figure, ax = plt.subplots()
    for P in (HPolytope.box([0.0, 2.0], [1e9, 2.0]), HPolytope.from_vertices([[0.0, 0.0], [1e9, 1.0]])):
        (patch,) = P.plot(ax=ax)
        assert len(patch.get_xy()) == 2 + 1
    plt.close(figure)


def test_a_solid_of_very_different_extents_has_its_faces():
    figure = plt.figure()
    (solid,) = HPolytope.box([0.0] * 3, [1e9, 1.0, 1e-3]).plot(ax=figure.add_subplot(projection="3d"), dims=(0, 1, 2))
    assert len(solid._faces) == 6
    assert solid._faces.shape[1] == 4
    plt.close(figure)
