"""Where a turning system can be after each step, whatever the disturbance does."""

import numpy as np
from matplotlib.pyplot import get_cmap, subplots

from polytopes import HPolytope
from svo.analysis.one_step_sets import LinearSystem, successor

turn = 0.93 * np.array([[np.cos(0.35), -np.sin(0.35)], [np.sin(0.35), np.cos(0.35)]])
system = LinearSystem(turn, disturbances=HPolytope.box([-0.05, -0.05], [0.05, 0.05]))
figure, ax = subplots(figsize=(5, 4.5))
now = HPolytope.box([3.5, -0.3], [4.2, 0.3])
for k in range(24):
    now.plot(ax, facecolor=get_cmap("plasma")(k / 24), alpha=0.7)
    now = successor(now, system).remove_redundancy()
ax.set(aspect="equal")
