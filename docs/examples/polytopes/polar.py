"""A set and its polar: vertices of the one are edges of the other, and the polar of the polar is the set."""

from matplotlib.pyplot import subplots

from polytopes import HPolytope

P = HPolytope.from_vertices([[2.0, 0.5], [0.5, 1.5], [-1.0, 1.0], [-1.5, -0.5], [0.5, -1.0]])
figure, ax = subplots(figsize=(4, 4))
P.plot(ax, facecolor="#3B7A57", label="P")
P.polar().plot(ax, facecolor="#C8553D", label="polar of P")
ax.plot(0, 0, "k+")
ax.set(aspect="equal")
ax.legend()
