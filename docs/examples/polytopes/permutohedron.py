"""All orders of four things are the vertices of a solid: flat in four dimensions, drawn in three."""

from itertools import permutations

import numpy as np
from matplotlib.pyplot import figure as new_figure

from polytopes import HPolytope

orders = HPolytope.from_vertices(list(permutations([1.0, 2.0, 3.0, 4.0])))
axes = np.array([[1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1]]) / 2
figure = new_figure(figsize=(4.5, 4.5))
ax = figure.add_subplot(projection="3d")
(axes @ orders).plot(ax, dims=(0, 1, 2), facecolor="#D9A441", alpha=0.9)
ax.set(box_aspect=(1, 1, 1), title="{} vertices, {} edges, {} faces".format(*orders.incidence().f_vector()))
