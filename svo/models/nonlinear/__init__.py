"""Nonlinear plants: their equations as tapes, enclosures of what they do, and linear models of it with remainders."""

from svo.models.nonlinear.carrier import Linearisation
from svo.models.nonlinear.flow import Span, Undecided
from svo.models.nonlinear.model import NonlinearModel
from svo.models.nonlinear.output import LinearOutput
from svo.models.nonlinear.transition import Transition

__all__ = ["LinearOutput", "Linearisation", "NonlinearModel", "Span", "Transition", "Undecided"]
