"""Sets that do not meet: the nearest points, and a line between them that is proved in rationals."""

from matplotlib.pyplot import subplots

from polytopes import HPolytope

P, Q = HPolytope.from_vertices([[0, 0], [2, 0], [2.5, 1.5], [1, 3]]), HPolytope.cross_polytope(2).translate([5, 3])
gap, plane = P.distance(Q), P.intersects(Q).plane
line = HPolytope([[0, 0]], [0], [plane.normal], [plane.offset]) & HPolytope.box([-1, -1], [7, 5])
figure, ax = subplots(figsize=(5, 4))
for S, colour in ((P, "#8FB3DC"), (Q, "#D9822B"), (line, "#444444")):
    S.plot(ax, facecolor=colour)
ax.plot(*zip(gap.point, gap.other, strict=True), "ko--")
ax.set(aspect="equal", title=f"distance {gap:.4f}")
