"""A set and its polar: vertices of the one are edges of the other, and the polar of the polar is the set."""

from matplotlib.pyplot import subplots

from polytopes import HPolytope

P = HPolytope.from_vertices([[2.0, 0.5], [0.5, 1.5], [-1.0, 1.0], [-1.5, -0.5], [0.5, -1.0]])
figure, ax = subplots(figsize=(4, 4))
P.plot(ax, facecolor="#9CC3AE", alpha=1.0, label="P")
P.polar().plot(ax, facecolor="#D97B66", alpha=0.8, label="polar of P")
ax.plot(0, 0, "k+")
ax.set(aspect="equal")
ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
