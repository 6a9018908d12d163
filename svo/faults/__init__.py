"""Fault objects that both corrupt a simulation and give the observer's model of the fault."""

from svo.faults.actuator import ActuatorFault, ActuatorLaw
from svo.faults.pair import FaultPair, pairs
from svo.faults.plant import PlantFault
from svo.faults.profiles import Exponential, Intermittent, Profile, Ramp, Step
from svo.faults.sensor import SensorFault, SensorLaw

__all__ = [
    "ActuatorFault",
    "ActuatorLaw",
    "Exponential",
    "FaultPair",
    "Intermittent",
    "PlantFault",
    "Profile",
    "Ramp",
    "SensorFault",
    "SensorLaw",
    "Step",
    "pairs",
]
