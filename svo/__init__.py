r"""Set-membership fault detection and isolation: uncertain models, set-valued observers, isolation banks.

    plant = find_plant("my.toml")
    found = detect(plant, read_log("flight.csv", plant))
    print(found, verify(found), sep="\n")

Sets are `polytopes.HPolytope`. Faults are in `svo.faults`, indices in `svo.indices`, the protocol of
plants in `svo.plant`, studies in `svo.studies.isolation`; the command line is ``svo --help``.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from svo.analysis.calibration import Calibration, calibrate
    from svo.analysis.distinguish import Distinguishability, distinguishability
    from svo.analysis.input_design import InputDesign, design_input
    from svo.detection.detect import detect
    from svo.detection.found import Detection
    from svo.detection.verification import Verification, verify
    from svo.isolation import ArchitectureI, ArchitectureII, BankRecord, Verdict
    from svo.logs.log import Log
    from svo.models import ScheduleTable, UncertainModel, Uncertainty
    from svo.models.nonlinear import NonlinearModel
    from svo.observers.polytope.observer import PolytopeObserver
    from svo.observers.window.chain import ChainCheck, LateMeasurement, prove_chain
    from svo.observers.window.observer import WindowObserver
    from svo.observers.zonotope.observer import ConstrainedZonotopeObserver
    from svo.plant.description.find import find_plant
    from svo.plant.log_file import read_log

__all__ = [
    "ArchitectureI",
    "ArchitectureII",
    "BankRecord",
    "Calibration",
    "ChainCheck",
    "ConstrainedZonotopeObserver",
    "Detection",
    "Distinguishability",
    "InputDesign",
    "LateMeasurement",
    "Log",
    "NonlinearModel",
    "PolytopeObserver",
    "ScheduleTable",
    "UncertainModel",
    "Uncertainty",
    "Verdict",
    "Verification",
    "WindowObserver",
    "calibrate",
    "design_input",
    "detect",
    "distinguishability",
    "find_plant",
    "prove_chain",
    "read_log",
    "verify",
]

_HOMES = {
    "ArchitectureI": "svo.isolation",
    "ArchitectureII": "svo.isolation",
    "BankRecord": "svo.isolation",
    "Calibration": "svo.analysis.calibration",
    "ChainCheck": "svo.observers.window.chain",
    "ConstrainedZonotopeObserver": "svo.observers.zonotope.observer",
    "Detection": "svo.detection.found",
    "Distinguishability": "svo.analysis.distinguish",
    "InputDesign": "svo.analysis.input_design",
    "LateMeasurement": "svo.observers.window.chain",
    "Log": "svo.logs.log",
    "NonlinearModel": "svo.models.nonlinear",
    "PolytopeObserver": "svo.observers.polytope.observer",
    "ScheduleTable": "svo.models",
    "UncertainModel": "svo.models",
    "Uncertainty": "svo.models",
    "Verdict": "svo.isolation",
    "Verification": "svo.detection.verification",
    "WindowObserver": "svo.observers.window.observer",
    "calibrate": "svo.analysis.calibration",
    "design_input": "svo.analysis.input_design",
    "detect": "svo.detection.detect",
    "distinguishability": "svo.analysis.distinguish",
    "find_plant": "svo.plant.description.find",
    "prove_chain": "svo.observers.window.chain",
    "read_log": "svo.plant.log_file",
    "verify": "svo.detection.verification",
}


def __getattr__(name: str) -> Any:
    # Imported when asked for: the command line must not wait for observers to print its help.
    if name not in _HOMES:
        raise AttributeError(f"module 'svo' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)
