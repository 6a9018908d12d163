"""Set-membership fault detection and isolation: uncertain models, set-valued observers, isolation banks.

Sets are `polytopes.HPolytope`. Faults are in `svo.faults`, indices in `svo.indices`, the protocol of
plants in `svo.plant`, studies in `svo.study`; the command line is ``svo --help``.
"""

from svo.isolation.architectures import ArchitectureI
from svo.isolation.record import BankRecord, Verdict
from svo.log import Log
from svo.model import UncertainModel, Uncertainty
from svo.observers.window import WindowObserver

__all__ = [
    "ArchitectureI",
    "BankRecord",
    "Log",
    "UncertainModel",
    "Uncertainty",
    "Verdict",
    "WindowObserver",
]
