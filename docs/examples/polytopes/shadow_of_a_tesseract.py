"""A cube in four dimensions: the shadow is a projection, the edges are pairs of adjacent vertices."""

import numpy as np
from matplotlib.pyplot import subplots

from polytopes import HPolytope

turn = np.linalg.qr(np.random.default_rng(6).standard_normal((4, 4)))[0]
cube = turn @ HPolytope.box(-np.ones(4), np.ones(4))
found = cube.incidence()
figure, ax = subplots(figsize=(4, 4))
cube.plot(ax, facecolor="#F2E4CF", alpha=1.0)
for i, j in np.argwhere(np.triu(found.vertex_adjacency())):
    ax.plot(*found.vertices[[i, j], :2].T, color="#7A4B12", linewidth=1.0)
ax.set(aspect="equal")
