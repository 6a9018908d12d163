"""A set without two others: a union of convex pieces whose interiors are disjoint."""

from matplotlib.pyplot import get_cmap, subplots

from polytopes import HPolytope

plate = HPolytope.box([0, 0], [6, 4])
holes = HPolytope.from_vertices([[1, 1], [2, 3], [3, 1]]) | HPolytope.cross_polytope(2).translate([4.5, 2])
rest = plate.difference(holes)
figure, ax = subplots(figsize=(5, 3.4))
for k, piece in enumerate(rest.pieces):
    piece.plot(ax, facecolor=get_cmap("viridis")(k / len(rest.pieces)), alpha=0.8)
ax.set(aspect="equal", title=f"{len(rest.pieces)} pieces, area {rest.volume():.3f}")
