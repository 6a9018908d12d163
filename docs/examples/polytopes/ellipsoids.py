"""The ellipse of largest area inside and the one of least area around a set."""

import numpy as np
from matplotlib.pyplot import subplots

from polytopes import HPolytope

P = HPolytope.from_vertices([[0, 0], [5, 0], [6, 2], [3, 4], [0.5, 3]])
angles = np.linspace(0.0, 2.0 * np.pi, 200)
circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
figure, ax = subplots(figsize=(5, 4))
P.plot(ax, facecolor="#8FB3DC")
ax.plot(*P.inscribed_ellipsoid().surface(circle).T, color="#2A5A94", label="largest inside")
ax.plot(*P.enclosing_ellipsoid().surface(circle).T, color="#C8553D", label="least around")
ax.plot(*P.centroid(), "k+", label="centroid")
ax.set(aspect="equal")
ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=8)
