"""Detection on a log, sample by sample, as an online loop would do it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from polytopes.signatures import options_by_name
from svo.detection.bank_alarms import alarms_of, source_of_bank
from svo.detection.found import Detection
from svo.detection.thresholds import DetectsThresholds
from svo.logs.columns import check_times
from svo.logs.log import Log, expect_log
from svo.plant import MonitoredPlant, chosen_noise
from svo.plant.dialects import on_log
from svo.plant.protocol import expect_plant
from svo.plant.scheduling import scheduled


def check_log(plant: MonitoredPlant, log: Log) -> None:
    """Raise an error if a log is not one of a plant: its channels, and its sampling time within 1 %.

    A log of events (`svo.Log.events`) may have any times.
    """
    expect_plant(plant)
    expect_log(log)
    replace(log, x=None).to_columns(plant.columns)
    if not log.events:
        check_times(log.time, plant.Ts, lambda k: f"log, sample {k}")


@options_by_name
def detect(
    plant: MonitoredPlant,
    log: Log,
    noise: str | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> Detection:
    """Run a plant's bank over a log, sample by sample, and say what it finds.

    Parameters
    ----------
    plant : MonitoredPlant
        As `svo.find_plant` gives it, or one of your own.
    log : Log
        As `svo.read_log` gives it. Only time, u and y are used; the plant's own scheduler makes the schedule of them.
    noise : str, optional
        Noise set whose bounds the observers assume; by default the plant's first.
    progress : callable, optional
        Called with (samples done, samples in all) after each sample.

    Returns
    -------
    Detection
        Printed, it says what it found; its alarms are checked again by `svo.verify`.

    Raises
    ------
    TypeError
        If the plant is a name, or the log no `svo.Log`.
    ValueError
        For an unknown noise set, and for a log without samples, with other channels, or of another sampling time.

    Examples
    --------
    >>> plant = find_plant("docs/examples/cart.toml")
    >>> print(detect(plant, read_log("docs/examples/cart.csv", plant)))  # doctest: +SKIP
    """
    check_log(plant, log)
    noise = chosen_noise(plant, noise)
    # First, for it takes no time, and what it may refuse would cost the bank's answer.
    thresholds = plant.detect_thresholds(log) if isinstance(plant, DetectsThresholds) else None
    bank = on_log(plant, log).bank(noise)
    record = bank.run(scheduled(plant.scheduler(), log), progress=progress)
    record = replace(record, labels=record.labels.in_columns(plant.columns))
    source = {**source_of_bank(plant), "noise": noise, **({} if log.source is None else {"log": log.source})}
    return Detection(plant, noise, log, record, alarms_of(record, log, source, bank.observers), thresholds)
