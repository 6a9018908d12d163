"""Plants: the protocol behind the entry points, what a plant can offer besides, and the registry.

Descriptions of plants in TOML are in `svo.plant.description`.
"""

from importlib import import_module
from typing import Any

from svo.logs.names import Column, Columns
from svo.plant.choice import (
    BankChoice,
    OffersArchitectures,
    OffersModels,
    architecture_of,
    bank_choice,
    in_architecture,
    with_bank,
)
from svo.plant.protocol import (
    HEALTHY,
    AddedStudy,
    Distribution,
    Exhibit,
    MonitoredPlant,
    Plant,
    Reference,
    StatedFault,
    TimesFaults,
    chosen_noise,
    fault_start,
    first_faulty_sample,
)
from svo.plant.registry import load_plant, registered_plants
from svo.plant.scheduling import (
    InputScheduler,
    SavesSchedule,
    Scheduler,
    no_schedule,
    resume_schedule,
    saved_schedule,
    schedule_of,
)

__all__ = [
    "HEALTHY",
    "AddedStudy",
    "AddsExhibits",
    "BankChoice",
    "Column",
    "Columns",
    "ComparesDetectors",
    "DetectsThresholds",
    "Distribution",
    "Exhibit",
    "InputScheduler",
    "LimitsInputs",
    "MonitoredPlant",
    "OffersArchitectures",
    "OffersModels",
    "Plant",
    "Reference",
    "SavesSchedule",
    "Scheduler",
    "StatedFault",
    "StatesFaults",
    "TimesFaults",
    "architecture_of",
    "bank_choice",
    "chosen_noise",
    "fault_start",
    "first_faulty_sample",
    "in_architecture",
    "load_plant",
    "no_schedule",
    "registered_plants",
    "resume_schedule",
    "saved_schedule",
    "schedule_of",
    "with_bank",
]

# Capabilities that a plant may have are declared beside what asks for them; their names are still found here.
_BESIDE_THEIR_USE = {
    "AddsExhibits": "svo.studies.added",
    "ComparesDetectors": "svo.studies.comparison.offer",
    "DetectsThresholds": "svo.detection.thresholds",
    "LimitsInputs": "svo.analysis.plant_input",
    "StatesFaults": "svo.analysis.isolability",
}


def __getattr__(name: str) -> Any:
    if name not in _BESIDE_THEIR_USE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_BESIDE_THEIR_USE[name]), name)
