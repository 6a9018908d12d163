"""The 3-D missile with control-induced redundancy (Marzat et al., SysTol 2010)."""

from aircraft.missile.plant import Missile, missile

__all__ = ["Missile", "missile"]
