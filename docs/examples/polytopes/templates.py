"""Fewer facets from outside: a polygon of forty corners by templates of four and of eight directions."""

import numpy as np
from matplotlib.pyplot import subplots

from polytopes import HPolytope

angles = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
P = HPolytope.from_vertices(circle @ [[3.0, 0.5], [1.0, 1.0]])
figure, ax = subplots(figsize=(5, 3.2))
for k, colour in ((4, "#DDE7F3"), (8, "#8FB3DC")):
    directions = np.stack([np.cos(2 * np.pi * np.arange(k) / k), np.sin(2 * np.pi * np.arange(k) / k)], axis=1)
    P.outer_template(directions).plot(ax, facecolor=colour, alpha=1.0)
P.plot(ax, facecolor="#2A5A94", alpha=1.0)
ax.set(aspect="equal")
