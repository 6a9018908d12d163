"""The observers' models with the Eclipse's own equations, against the compiled simulator."""

from collections.abc import Callable

import numpy as np
import pytest

from aircraft.eclipse.derivatives import Derivatives
from aircraft.eclipse.equations import Equations, nonlinear_models
from aircraft.eclipse.manoeuvres import manoeuvres
from aircraft.eclipse.noise import NOISE_SETS
from aircraft.eclipse.plant import INITIAL_LOWER, INITIAL_UPPER
from aircraft.eclipse.scenarios import FAULTS, HEALTHY, LARGEST, TS, Scenarios
from aircraft.eclipse.simulator import Surrogate
from aircraft.eclipse.trim import level_trim
from polytopes import HPolytope
from svo import WindowObserver
from svo.checks import Array
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models.nonlinear import NonlinearModel

SURROGATES = {"identified": Surrogate(), "another": Surrogate(CLa=2.5, k=0.3, Cmad=0.2, normal_coupling=-1.0)}
Models = dict[str, NonlinearModel]
SCENARIOS = Scenarios()
HYPOTHESES = ("nominal", *FAULTS)
# A flight with large manoeuvres: u, w, theta, q.
LOWEST, HIGHEST = np.array([24.0, -3.0, -0.55, -0.8]), np.array([50.0, 7.0, 0.55, 0.8])


def models(
    noise: str = "quiet", surrogate: Surrogate | None = None, reference: float = 0.0
) -> dict[str, NonlinearModel]:
    equations = Equations(surrogate or Surrogate(), moment_reference=reference)
    faults = {name: SCENARIOS.fault(name, LARGEST) for name in FAULTS}
    return nonlinear_models(equations, NOISE_SETS[noise], faults, TS, (INITIAL_LOWER, INITIAL_UPPER))


def simulated(hypothesis: str, surrogate: Surrogate, reference: float) -> Callable[[Array, Array, Array, Array], Array]:
    """dx/dt at x (K, 4), u (K, 2), gusts d (K, 3) and the fault's size p (K, 1 or 0), by the compiled simulator."""

    def derivative(x: Array, u: Array, d: Array, p: Array) -> Array:
        if hypothesis == "elevator":
            u = u * np.hstack([1.0 - p, np.ones_like(p)])
        rates = surrogate.derivative(x, u, d)
        if hypothesis == "dynamics":
            M_u = Derivatives().value("M_u", np.hypot(x[:, 0], x[:, 1]))
            rates[:, 3] += 0.3 * p[:, 0] * M_u * (x[:, 0] - reference)
        return rates

    return derivative


def points(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    """States and inputs all over a flight with large manoeuvres."""
    return rng.uniform(LOWEST, HIGHEST, (count, 4)), rng.uniform([-25.0, 0.0], [25.0, 0.39], (count, 2))


@pytest.mark.parametrize("hypothesis", HYPOTHESES)
@pytest.mark.parametrize("surrogate", SURROGATES)
def test_the_equations_are_the_simulators_to_rounding(hypothesis: str, surrogate: str) -> None:
    rng, reference = np.random.default_rng(17), 36.8
    model = models(surrogate=SURROGATES[surrogate], reference=reference)[hypothesis]
    x, u = points(rng, 2000)
    d, p = rng.normal(size=(2000, 3)), rng.uniform(0.0, 1.0, (2000, len(model.parameters)))
    expected = simulated(hypothesis, SURROGATES[surrogate], reference)(x, u, d, p)
    np.testing.assert_allclose(model.flow.tape.values(np.hstack([x, d, p, u])), expected, rtol=1e-13, atol=1e-12)
    read = np.column_stack([np.hypot(x[:, 0], x[:, 1]), np.arctan2(x[:, 1], x[:, 0]), x[:, 2:]])
    np.testing.assert_allclose(model.reading.values(np.hstack([x, d, p, u])), read, rtol=1e-14)


@pytest.mark.parametrize("hypothesis", HYPOTHESES)
def test_a_transition_holds_what_the_simulator_does_within_a_sample(hypothesis: str) -> None:
    """Random boxes of all sizes, states, gusts and sizes of the fault at corners and inside, 32 steps a sample."""
    model, rng = models("conservative")[hypothesis], np.random.default_rng(18)
    derivative, w = simulated(hypothesis, Surrogate(), 0.0), model.flow.w
    for centre, u in zip(*points(rng, 12), strict=True):
        radius = 10.0 ** rng.uniform(-4.0, 0.0) * np.array([0.5, 0.3, 0.01, 0.01])
        found = model.transition(centre - radius, centre + radius, u)
        x = centre + radius * _unit(rng, 40, 4)
        disturbed = w.lower + (w.upper - w.lower) * (0.5 + 0.5 * _unit(rng, 40, len(w.lower)))
        end = _flown(derivative, x, np.tile(u, (40, 1)), disturbed[:, :3], disturbed[:, 3:])
        missed = np.abs(end - x @ found.A.T - found.a - disturbed @ found.E.T) - found.R
        assert (missed <= 1e-12).all(), (hypothesis, centre, radius, missed.max(axis=0))


def _unit(rng: np.random.Generator, count: int, size: int) -> Array:
    """Points of [-1, 1]^size, half of them corners."""
    inside = rng.uniform(-1.0, 1.0, (count, size))
    return np.where(np.arange(count)[:, None] % 2, np.where(inside < 0.0, -1.0, 1.0), inside)


def _flown(derivative: Callable[..., Array], x: Array, *held: Array, steps: int = 32) -> Array:
    """One sample by Runge and Kutta's method."""
    h = TS / steps
    for _ in range(steps):
        k1 = derivative(x, *held)
        k2 = derivative(x + 0.5 * h * k1, *held)
        k3 = derivative(x + 0.5 * h * k2, *held)
        x = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + derivative(x + h * k3, *held))
    return x


@pytest.mark.parametrize(("fault", "profile"), [(HEALTHY, HEALTHY), *((fault, "hard") for fault in FAULTS)])
def test_the_true_state_is_inside_and_a_true_model_is_not_falsified(fault: str, profile: str) -> None:
    hypothesis = "nominal" if fault == HEALTHY else fault
    run, samples = SCENARIOS.run(fault, profile, "quiet", 5), 90
    log = Log(time=run.time[:samples], u=run.flight.u[:samples], y=run.flight.y[:samples])
    initial = HPolytope.box(INITIAL_LOWER, INITIAL_UPPER)
    for k, step in enumerate(drive(WindowObserver(models()[hypothesis], initial, horizon=10), log)):
        assert step.verdict == "consistent", (k, step.reason)
        lower, upper = step.box
        assert ((lower <= run.flight.x[k, :4]) & (run.flight.x[k, :4] <= upper)).all(), k


def test_large_manoeuvres_raise_no_alarm_and_nothing_is_measured_for_them() -> None:
    log = manoeuvres(5.0, "quiet", 9, SCENARIOS.fault("dynamics", "hard"))
    assert log.x is not None
    assert np.ptp(log.y[:, 0]) > 12.0
    assert np.degrees(np.abs(log.x[:, 2]).max()) > 25.0
    observer = WindowObserver(models()["dynamics"], HPolytope.box(INITIAL_LOWER, INITIAL_UPPER), horizon=10)
    for step, x in zip(drive(observer, log), log.x, strict=True):
        assert step.verdict == "consistent"
        lower, upper = step.box
        assert ((lower <= x) & (x <= upper)).all()


def test_one_measurement_bounds_a_state_that_may_be_anywhere_as_well_as_the_sensors_allow() -> None:
    """The outputs are linearised again and again over what their own readings leave."""
    trim, n = level_trim(Surrogate(), 37.0), np.array(NOISE_SETS["quiet"].sensors)
    observer = WindowObserver(models()["nominal"], HPolytope.box(INITIAL_LOWER, INITIAL_UPPER), horizon=10)
    lower, upper = observer.update(y0=trim.y).box
    along, across = n[0] + 37.0 * np.sin(trim.alpha) * n[1], 37.0 * n[1] + np.sin(trim.alpha) * n[0]
    assert (upper - lower <= 2.05 * np.array([along, across, n[2], n[3]])).all()
