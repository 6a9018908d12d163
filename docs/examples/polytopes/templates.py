"""Fewer facets: a polygon of forty corners between templates of four and of eight directions, around and inside."""

import numpy as np
from matplotlib.pyplot import subplots

from polytopes import HPolytope

angles = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
P = HPolytope.from_vertices(circle @ [[3.0, 0.5], [1.0, 1.0]])
figure, ax = subplots(figsize=(5, 3.2))
P.outer_template(circle[::10]).plot(ax, facecolor="#DDE7F3", alpha=1.0, label="4 directions, around")
P.outer_template(circle[::5]).plot(ax, facecolor="#8FB3DC", alpha=1.0, label="8, around")
P.plot(ax, facecolor="#2A5A94", alpha=1.0, label="40 facets")
P.inner_template(circle[::5]).plot(ax, facecolor="#D9822B", alpha=1.0, label="8, inside")
ax.set(aspect="equal")
ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, fontsize=7)
