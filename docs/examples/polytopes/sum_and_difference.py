"""A sum grows a set by another at every point, the Pontryagin difference shrinks it: P - Q is where Q fits in."""

import numpy as np
from matplotlib.pyplot import subplots

from polytopes import HPolytope

angles = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
P = HPolytope.from_vertices([[-3, -1], [-1, -3], [3, -2], [2, 2], [-2, 2]])
Q = HPolytope.from_vertices(0.7 * np.stack([np.cos(angles), np.sin(angles)], axis=1))
figure, ax = subplots(figsize=(4, 4))
drawn = {"P + Q": (P + Q, "#DDE7F3"), "P": (P, "#8FB3DC"), "P - Q": (P - Q, "#2A5A94"), "Q": (Q, "#D9822B")}
for name, (S, colour) in drawn.items():
    S.plot(ax, facecolor=colour, alpha=1.0, label=name)
ax.set(aspect="equal")
ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, fontsize=8)
