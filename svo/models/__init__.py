"""Uncertain linear parameter-varying models: construction, discretisation, normal form, simulation."""

from svo.models.digest import ModelSample, model_digest
from svo.models.discretisation import zero_order_hold
from svo.models.labels import Labels
from svo.models.model import Schedulable, UncertainModel, expect_model
from svo.models.normal_form import Exponents, NormalForm, power, set_in
from svo.models.schedule_table import ScheduleTable
from svo.models.stack import may_be_nonzero
from svo.models.uncertainty import Uncertainty

__all__ = [
    "Exponents",
    "Labels",
    "ModelSample",
    "NormalForm",
    "Schedulable",
    "ScheduleTable",
    "UncertainModel",
    "Uncertainty",
    "expect_model",
    "may_be_nonzero",
    "model_digest",
    "power",
    "set_in",
    "zero_order_hold",
]
