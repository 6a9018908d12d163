"""Exact supports of sets given by generators in integers: the largest product over all vertices, by fractions."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from polytopes.minkowski_weyl import ExactGenerators
from polytopes.outward_normals import support_of


def generators(vertices: list[list[int]], rays: list[list[int]] | None = None) -> ExactGenerators:
    n = len(vertices[0]) - 1
    return ExactGenerators(
        np.array(vertices, dtype=object),
        np.array(rays or [], dtype=object).reshape(-1, n),
        np.zeros((0, n), dtype=object),
    )


def by_fractions(vertices: list[list[int]], normal: np.ndarray) -> Fraction:
    exact = [Fraction(v) for v in normal.tolist()]
    products = ((sum(a * x for a, x in zip(exact, row, strict=False)), row[-1]) for row in vertices)
    return max(Fraction(value, size) for value, size in products)


@pytest.mark.parametrize("scale", [-1060, -500, 0, 500, 1060])
@pytest.mark.parametrize("seed", range(20))
def test_it_is_that_of_the_farthest_vertex_though_many_are_as_far_up_to_rounding(seed: int, scale: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    normal = rng.normal(size=n) * 2.0 ** rng.integers(-30, 30, n)
    vertices = []
    for _ in range(40):
        point = [Fraction(v) for v in rng.normal(size=n).tolist()]
        level = sum((Fraction(a) * v for a, v in zip(normal.tolist(), point, strict=True)), Fraction())
        j = int(rng.integers(n))  # moved onto one plane across the normal, but for some 2^-60 of its size
        point[j] += (1 + Fraction(int(rng.integers(-9, 9)), 2**60) - level) / Fraction(float(normal[j]))
        t = int(rng.integers(1, 2**40))
        vertices.append([int(v * t * 2**80) for v in point] + [t * 2**80])
    up, down = 2 ** max(scale, 0), 2 ** max(-scale, 0)
    vertices = [[v * up for v in row[:-1]] + [row[-1] * down] for row in vertices]
    assert support_of(generators(vertices), normal) == by_fractions(vertices, normal)


def test_vertices_beyond_the_range_of_floats_count() -> None:
    vertices = [[1, 1], [2**2000, 1], [3, 2**1500]]
    assert support_of(generators(vertices), np.array([1.0])) == 2**2000
    assert support_of(generators(vertices), np.array([-1.0])) == Fraction(-3, 2**1500)


def test_along_a_ray_it_is_unbounded() -> None:
    assert support_of(generators([[0, 0, 1]], [[1, -1]]), np.array([1.0, 0.5])) == np.inf
    assert support_of(generators([[0, 0, 1]], [[1, -1]]), np.array([1.0, 1.0])) == 0
