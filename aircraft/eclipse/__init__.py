"""The Eclipse UAV, longitudinal axis (Rosa and Silvestre, Control Engineering Practice 21, 2013)."""

from aircraft.eclipse.plant import Eclipse, eclipse

__all__ = ["Eclipse", "eclipse"]
