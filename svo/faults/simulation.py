"""Runs of a nonlinear plant in which a fault begins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from polytopes.signatures import options_by_name
from svo.checks import Array, expect_kind, finite_array
from svo.faults.actuator import ActuatorFault
from svo.faults.pair import Fault, FaultPair
from svo.faults.parameter import ParameterFault
from svo.faults.plant import PlantFault
from svo.faults.sensor import SensorFault
from svo.logs.log import Log
from svo.models.draws import draw
from svo.models.nonlinear import NonlinearModel


@options_by_name
def simulate_fault(
    model: NonlinearModel,
    acting: Fault | FaultPair,
    x0: ArrayLike,
    u: ArrayLike,
    rng: np.random.Generator,
    *,
    corners: bool = False,
    substeps: int = 20,
) -> Log:
    """A run of a plant with a fault from its profile's start on; its observers' model is ``acting.model(model)``.

    Parameters
    ----------
    model : NonlinearModel
        The healthy plant.
    acting : fault of `svo.faults`, or a pair
        Its times are those from the run's first sample, which is at 0 s.
    x0 : (n,) array
        Or only the states of f: parameters that are constant are then drawn.
    u : (K, nu) array
        What is commanded, one row a sample: the log has it, and the plant what a faulty actuator makes of it.
    rng, corners, substeps
        As of `NonlinearModel.simulate`.

    Returns
    -------
    Log
        With the true states of ``model``; a constant parameter is one until the fault moves it.

    Raises
    ------
    TypeError, ValueError
        As `NonlinearModel.simulate` and the fault's ``model``.
    """
    expect_kind("model", model, NonlinearModel, "a NonlinearModel")
    expect_kind("acting", acting, (*_KINDS, FaultPair), "a fault of svo.faults, or a FaultPair")
    commands = finite_array("u", u, ("samples", model.n_inputs))
    expect_kind("rng", rng, np.random.Generator, "a numpy Generator, such as np.random.default_rng(0)")
    time = np.arange(len(commands)) * model.Ts
    faults = acting.members if isinstance(acting, FaultPair) else (acting,)
    first = dict(zip(model.flow.states, model.first_state(x0, rng, corners=corners).tolist(), strict=True))
    plant, sizes = model, dict[str, Array]()
    for one in faults:
        if isinstance(one, ParameterFault | PlantFault):
            low, high = one.healthy(plant) if isinstance(one, ParameterFault) else (0.0, 0.0)
            plant = one.model(plant)
            name = one.parameter if isinstance(one, ParameterFault) else tuple(plant.parameters)[-1]
            healthy = sizes.get(name)
            if healthy is None:
                lower, upper = (np.full(len(time), first.get(name, end)) for end in (low, high))
                healthy = draw(lower, upper, rng, corners)
            sizes[name] = healthy + one.delta(time)
    achieved = commands
    for one in faults:
        achieved = one.corrupt(time, achieved) if isinstance(one, ActuatorFault) else achieved
    begun = [first[name] for name in plant.flow.states]
    log = plant.simulate(begun, achieved, rng, corners=corners, substeps=substeps, parameters=sizes)
    assert log.x is not None
    y, known = log.y, sizes | dict(zip(plant.flow.states, log.x.T, strict=True))
    for one in faults:
        y = one.corrupt(time, y) if isinstance(one, SensorFault) else y
    return replace(log, u=commands, y=y, x=np.column_stack([known[name] for name in model.flow.states]))


_KINDS = (ActuatorFault, ParameterFault, PlantFault, SensorFault)
