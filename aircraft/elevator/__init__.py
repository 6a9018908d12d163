"""The servo-loop of an elevator (Combastel, Thabet, Raïssi, Zolghadri and Gucik, IFAC World Congress 2014)."""

from aircraft.elevator.plant import Elevator, elevator

__all__ = ["Elevator", "elevator"]
