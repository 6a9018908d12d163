"""Fault objects that both corrupt a simulation and give the observer's model of the fault."""

from svo.faults.actuator import ActuatorFault, ActuatorLaw
from svo.faults.pair import FaultPair, pairs
from svo.faults.parameter import ParameterFault
from svo.faults.plant import PlantFault
from svo.faults.profiles import Exponential, Intermittent, Profile, Ramp, Step
from svo.faults.sensor import SensorFault, SensorLaw
from svo.faults.simulation import simulate_fault

__all__ = [
    "ActuatorFault",
    "ActuatorLaw",
    "Exponential",
    "FaultPair",
    "Intermittent",
    "ParameterFault",
    "PlantFault",
    "Profile",
    "Ramp",
    "SensorFault",
    "SensorLaw",
    "Step",
    "pairs",
    "simulate_fault",
]
