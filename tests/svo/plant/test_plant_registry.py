"""Plants are found by their entry points, whoever registered them."""

from __future__ import annotations

from importlib.metadata import EntryPoint
from typing import Any

import pytest
from typer.testing import CliRunner

from svo.cli import app
from svo.plant import Plant, load_plant, registered_plants, registry


def test_a_registered_plant_is_listed_and_loaded(registered_tank: str) -> None:
    names = list(registered_plants())
    assert names == sorted(names)
    assert registered_tank in names
    plant = load_plant(registered_tank)
    assert isinstance(plant, Plant)
    assert plant.name == registered_tank


def test_listing_does_not_import_a_plant(monkeypatch: pytest.MonkeyPatch) -> None:
    register(monkeypatch, "broken", "no.such.module:plant")
    assert list(registered_plants()) == ["broken"]
    with pytest.raises(ImportError, match=r"plant 'broken' of group svo.plants cannot be loaded: No module named 'no'"):
        load_plant("broken")
    register(monkeypatch, "nameless", "math:plant")
    with pytest.raises(ImportError, match=r"plant 'nameless' .* cannot be loaded: .*no attribute 'plant'"):
        load_plant("nameless")


def test_a_broken_plant_hides_no_other(monkeypatch: pytest.MonkeyPatch, registered_tank: str) -> None:
    points = [*registry.entry_points(group="svo.plants"), EntryPoint("broken", "no.such.module:plant", "svo.plants")]
    monkeypatch.setattr(registry, "entry_points", lambda group: points)
    result = CliRunner().invoke(app, ["plants"])
    assert result.exit_code == 0
    assert "tank: Water tank" in result.stdout
    assert "note: plant 'broken' of group svo.plants cannot be loaded" in result.stderr


def test_an_unknown_name_is_answered_with_the_known_ones(monkeypatch: pytest.MonkeyPatch, registered_tank: str) -> None:
    with pytest.raises(ValueError, match=r"no plant is registered as 'zeppelin'.*svo\.plants; registered: .*tank"):
        load_plant("zeppelin")
    monkeypatch.setattr(registry, "entry_points", lambda group: ())
    with pytest.raises(ValueError, match="registered: none"):
        load_plant("zeppelin")


def test_what_is_no_plant_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    register(monkeypatch, "dictionary", "builtins:dict")
    with pytest.raises(TypeError, match=r"entry point 'dictionary' of group svo\.plants gave dict"):
        load_plant("dictionary")
    register(monkeypatch, "number", "math:pi")
    with pytest.raises(TypeError, match=r"gave float, which is not a Plant: it lacks name, title, Ts, .*scheduler"):
        load_plant("number")


def test_an_entry_point_may_be_the_plant_itself(monkeypatch: pytest.MonkeyPatch, registered_tank: str) -> None:
    plant = load_plant(registered_tank)
    monkeypatch.setattr("tank_plant.ready", plant, raising=False)
    register(monkeypatch, "ready", "tank_plant:ready")
    assert load_plant("ready") is plant


def register(monkeypatch: pytest.MonkeyPatch, name: str, value: str) -> None:
    """Let this be the only entry point there is."""

    def only(group: str) -> Any:
        return [EntryPoint(name, value, group)]

    monkeypatch.setattr(registry, "entry_points", only)
