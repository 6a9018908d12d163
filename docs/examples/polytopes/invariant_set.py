"""Where a disturbed system stays for ever: the largest set in a constraint, and a smallest one that it ends in."""

from matplotlib.pyplot import subplots

from polytopes import HPolytope
from svo.analysis.invariant_sets import largest_invariant_set, smallest_invariant_set
from svo.analysis.one_step_sets import LinearSystem

A, W = [[0.75, 0.5], [-0.5, 0.75]], HPolytope.box([-0.0625, -0.125], [0.0625, 0.125])
system, constraint = LinearSystem(A, disturbances=W), HPolytope.box([-2, -1.5], [2, 1.5])
figure, ax = subplots(figsize=(5, 4))
constraint.plot(ax, facecolor="#F4F4F4", alpha=1.0, label="constraint")
largest_invariant_set(constraint, system).set.plot(ax, facecolor="#9CC3AE", alpha=1.0, label="largest invariant set")
smallest_invariant_set(system, factor=0.3).set.plot(ax, facecolor="#D97B66", alpha=1.0, label="a smallest one")
ax.set(aspect="equal")
ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=7)
