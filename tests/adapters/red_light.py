"""The traffic of the shipped red light, and what tests change of it."""

from collections.abc import Mapping
from dataclasses import is_dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any, Final

import scenarios
from adapters.sumo.entities import Entity
from adapters.sumo.parameters import TrafficParameters
from orchestrator.scenario.build import load_scenario
from orchestrator.timebase import Duration, seconds

SCENARIO: Final = Path(scenarios.__file__).with_name("red_light.yaml")
ASSETS: Final = SCENARIO.parent / "assets" / "red_light"
SCENE: Final = ASSETS / "red_light.sumocfg"
STEP: Final = 50_000_000
"""Of traffic, and of SUMO [ns]."""

ALONE: Final[Mapping[str, Any]] = {"collider": None}
"""The change of `entities` after which nobody runs the red light."""


def red_light(**changes: Any) -> TrafficParameters:
    """The parameters of `traffic` in `scenarios/red_light.yaml`, changed as a scenario would.

    Args:
        **changes: by parameter, in SI units. A mapping changes only what it names, at any depth:
            `entities={"ego": {"position": {"to_end": 30.0}}, "collider": None}`.
    """
    return replace(_shipped(), **{name: _changed(_shipped(), name, changes) for name in changes})


def entity(parameters: TrafficParameters, name: str) -> Entity:
    """One of the entities, which must be declared."""
    found = parameters.entities[name]
    assert found is not None
    return found


def ego_speed(parameters: TrafficParameters) -> float:
    """The speed of the ego vehicle at the start [m/s], which must be a single one."""
    speed = entity(parameters, "ego").speed
    assert speed.is_constant
    return speed.lowest


def options(scene: Path, step: Duration = STEP, seed: int = 0) -> list[str]:
    """Options with which SUMO loads `scene`, steps of `step` [ns] and says nothing.

    Args:
        scene: a SUMO configuration.
        step: of SUMO [ns].
        seed: of its own random numbers.
    """
    given = {
        "--configuration-file": str(scene),
        "--step-length": f"{seconds(step):.3f}",
        "--seed": str(seed),
        "--collision.action": "none",
        "--no-step-log": "true",
        "--no-warnings": "true",
        "--duration-log.disable": "true",
    }
    return [word for option in given.items() for word in option]


@cache
def _shipped() -> TrafficParameters:
    return TrafficParameters(**load_scenario(SCENARIO).components["traffic"].values)


def _changed(whole: Any, name: str, changes: Mapping[str, Any]) -> Any:
    """The value `name` of a dataclass or mapping after `changes` of it."""
    change = changes[name]
    value = whole.get(name) if isinstance(whole, Mapping) else getattr(whole, name)
    if not isinstance(change, Mapping):
        return change
    made = {inner: _changed(value, inner, change) for inner in change}
    if isinstance(value, Mapping):
        return {**value, **made}
    assert is_dataclass(value), f"there is no `{name}` to change"
    assert not isinstance(value, type)
    return replace(value, **made)
