"""Two tanks in a row, from their equations to a proven alarm: the first one leaks from sample 60 on."""

import numpy as np

from polytopes import HPolytope
from svo import ArchitectureI, Log, NonlinearModel, WindowObserver
from svo.functions import sqrt, sroot

AREA, PIPE, OUTLET, G2 = 154.0, 0.25, 0.3, 2 * 981.0  # cm^2, cm^2, cm^2, cm/s^2


def tanks(largest_hole: float) -> NonlinearModel:
    """Levels in cm; the first tank may have a hole of any area up to the largest one, in cm^2."""

    def f(h, u, w, p):
        between, out = PIPE * sroot(G2 * (h[0] - h[1])), OUTLET * sqrt(G2 * h[1])
        return [(u[0] - between - p[0] * sqrt(G2 * h[0])) / AREA + w[0], (between - out) / AREA + w[1]]

    return NonlinearModel(
        f,
        lambda h: h,
        states=["h1", "h2"],
        inputs=["pump"],
        disturbances=["d1", "d2"],
        parameters={"hole": (0.0, largest_hole)},
        Ts=2.0,  # s
        n=[0.1, 0.1],  # cm
        w=[0.002, 0.002],  # cm/s
        physical=([0.0, 0.0], [60.0, 60.0]),  # cm
    )


def observer(model: NonlinearModel) -> WindowObserver:
    """It knows the first levels to within 2 cm."""
    return WindowObserver(model, HPolytope.box([28.0, 10.0], [32.0, 14.0]))


healthy, leaky = tanks(0.0), tanks(0.2)
pump = np.array([[60.0 + 10.0 * np.sin(0.05 * k)] for k in range(90)])
rng = np.random.default_rng(1)
before = healthy.simulate([30.0, 12.0], pump[:61], rng)
after = leaky.simulate(before.x[-1], pump[60:], rng)
log = Log(2.0 * np.arange(90), pump, np.vstack([before.y[:-1], after.y]))

bank = ArchitectureI(nominal=observer(healthy), faults={"leak": observer(leaky)})
record = bank.run(log)
print(f"{record.fault} isolated at sample {record.isolated_at}, 60 is the first that leaks")
print("the proof that the healthy tanks explain nothing holds:", record.certificates["nominal"].verify())
