"""Plants: the protocol behind the entry points, what a plant can offer besides, and the registry.

Descriptions of plants in TOML are in `svo.plant.description`.
"""

from svo.logs.names import Column, Columns
from svo.plant.protocol import (
    HEALTHY,
    AddsExhibits,
    ComparesDetectors,
    DetectsThresholds,
    Distribution,
    Exhibit,
    LimitsInputs,
    MonitoredPlant,
    OffersArchitectures,
    Plant,
    Reference,
    StatedFault,
    StatesFaults,
    TimesFaults,
    architecture_of,
    fault_start,
    first_faulty_sample,
    in_architecture,
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
    "AddsExhibits",
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
    "Plant",
    "Reference",
    "SavesSchedule",
    "Scheduler",
    "StatedFault",
    "StatesFaults",
    "TimesFaults",
    "architecture_of",
    "fault_start",
    "first_faulty_sample",
    "in_architecture",
    "load_plant",
    "no_schedule",
    "registered_plants",
    "resume_schedule",
    "saved_schedule",
    "schedule_of",
]
