"""Isolation banks: observers of several models beside one another, what they conclude, and alarms with their proofs."""

from svo.isolation.alarms import (
    NONLINEAR,
    NOT_CHECKED,
    STAMPED,
    Alarm,
    AlarmCheck,
    check_alarm,
    read_alarms,
    verify_alarms,
    write_alarms,
)
from svo.isolation.architectures import ArchitectureI, ArchitectureII
from svo.isolation.bank import Bank
from svo.isolation.logic import GLOBAL, NOMINAL
from svo.isolation.record import BankRecord, Verdict
from svo.isolation.recorder import Change, Outcome, Recorder

__all__ = [
    "GLOBAL",
    "NOMINAL",
    "NONLINEAR",
    "NOT_CHECKED",
    "STAMPED",
    "Alarm",
    "AlarmCheck",
    "ArchitectureI",
    "ArchitectureII",
    "Bank",
    "BankRecord",
    "Change",
    "Outcome",
    "Recorder",
    "Verdict",
    "check_alarm",
    "read_alarms",
    "verify_alarms",
    "write_alarms",
]
