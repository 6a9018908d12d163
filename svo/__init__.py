"""Set-membership fault detection and isolation: uncertain models, set-valued observers, isolation banks.

Sets are `polytopes.HPolytope`. Faults are in `svo.faults`, indices in `svo.indices`, the protocol of
plants in `svo.plant`, studies in `svo.study`; the command line is ``svo --help``.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from svo.calibration import Calibration, calibrate
    from svo.distinguish import Distinguishability, distinguishability
    from svo.input_design import InputDesign, design_input
    from svo.isolation.architectures import ArchitectureI, ArchitectureII
    from svo.isolation.record import BankRecord, Verdict
    from svo.log import Log
    from svo.model import UncertainModel
    from svo.observers.chain import ChainCheck, LateMeasurement, prove_chain
    from svo.observers.polytope import PolytopeObserver
    from svo.observers.window import WindowObserver
    from svo.observers.zonotope import ConstrainedZonotopeObserver
    from svo.schedule_table import ScheduleTable
    from svo.uncertainty import Uncertainty

__all__ = [
    "ArchitectureI",
    "ArchitectureII",
    "BankRecord",
    "Calibration",
    "ChainCheck",
    "ConstrainedZonotopeObserver",
    "Distinguishability",
    "InputDesign",
    "LateMeasurement",
    "Log",
    "PolytopeObserver",
    "ScheduleTable",
    "UncertainModel",
    "Uncertainty",
    "Verdict",
    "WindowObserver",
    "calibrate",
    "design_input",
    "distinguishability",
    "prove_chain",
]

_HOMES = {
    "ArchitectureI": "svo.isolation.architectures",
    "ArchitectureII": "svo.isolation.architectures",
    "BankRecord": "svo.isolation.record",
    "Calibration": "svo.calibration",
    "ChainCheck": "svo.observers.chain",
    "ConstrainedZonotopeObserver": "svo.observers.zonotope",
    "Distinguishability": "svo.distinguish",
    "InputDesign": "svo.input_design",
    "LateMeasurement": "svo.observers.chain",
    "Log": "svo.log",
    "PolytopeObserver": "svo.observers.polytope",
    "ScheduleTable": "svo.schedule_table",
    "UncertainModel": "svo.model",
    "Uncertainty": "svo.uncertainty",
    "Verdict": "svo.isolation.record",
    "WindowObserver": "svo.observers.window",
    "calibrate": "svo.calibration",
    "design_input": "svo.input_design",
    "distinguishability": "svo.distinguish",
    "prove_chain": "svo.observers.chain",
}


def __getattr__(name: str) -> Any:
    # Imported when asked for: the command line must not wait for compiled kernels to print its help.
    if name not in _HOMES:
        raise AttributeError(f"module 'svo' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
