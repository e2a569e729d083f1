"""Parameters of `SumoTraffic`."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final, Literal

from adapters.sumo.entities import Entity
from orchestrator.parameters import parameter

BUILDING_HEIGHT: Final = 10.0
"""The height of buildings that say none [m], unless a scenario says another."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Equipment:
    """What some of the road users carry that are no entities; later rules override earlier ones."""

    vehicles: str = parameter(
        "*",
        doc="pattern of the names they have in SUMO: *, ?, [...]; a rule for all names and types "
        "leaves bicycles and persons out",
    )
    types: str = parameter("*", doc="pattern of their types")
    radio: float | None = parameter(
        None, minimum=0.0, maximum=1.0, doc="the share of them with a V2X radio (drawn)"
    )
    lidar: float | None = parameter(
        None, minimum=0.0, maximum=1.0, doc="the share of them with a lidar (drawn)"
    )
    lidar_limit: int | None = parameter(
        None, minimum=0, doc="most of their lidars at a time; null: no limit"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Background:
    """Traffic that fills the net besides the scene's own, one vehicle per `spacing` and lane."""

    spacing: float = parameter(
        30.0, unit="m", minimum=15.0, doc="one vehicle per this many metres and lane"
    )
    turning_share: float = parameter(
        0.2, minimum=0.0, maximum=1.0, doc="of the vehicles on lanes that allow it, those turning"
    )
    changes_lanes: bool = parameter(default=True, doc="whether they may change lanes")
    tall_share: float | None = parameter(
        None,
        minimum=0.0,
        maximum=1.0,
        doc="of the vehicles, those of types higher than 2 m, among which the proportions of the "
        "scene stay; null: as the types of the scene say",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin:
    """A point of the net."""

    x: float = parameter(unit="m", doc="east")
    y: float = parameter(unit="m", doc="north")


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficParameters:
    """Parameters of `SumoTraffic`."""

    scene: Path = parameter(doc="SUMO configuration (*.sumocfg): net, demand, types, polygons")
    step_length: float = parameter(
        0.05, unit="s", minimum=0.001, maximum=10.0, doc="SUMO's own step; divides the step size"
    )
    sumo_seed: int | None = parameter(
        None,
        minimum=0,
        maximum=2**31 - 1,
        doc="of SUMO's own random numbers; null: drawn from the component's stream",
    )
    scale: float | None = parameter(
        None,
        minimum=0.0,
        doc="how many times the scene's own demand departs, 0.5: every second vehicle and person, "
        "half of each flow; null: as the configuration says",
    )
    entities: Mapping[str, Entity | None] = parameter(
        MappingProxyType({}), doc="who takes part besides the traffic of the scene, by name"
    )
    background: Background | None = parameter(
        None, doc="more traffic than the scene's own; null: none"
    )
    equipment: Mapping[str, Equipment | None] = parameter(
        MappingProxyType({"all": Equipment(radio=1.0, lidar=0.0)}),
        doc="rules by name: what those carry that are no entities",
    )
    origin: Origin | None = parameter(
        None,
        doc="what all positions are relative to, in the coordinates of the net; null: their own "
        "origin, or the corner of a net that is more than 100 km away from it",
    )
    collision_step: float = parameter(
        0.01,
        unit="s",
        minimum=0.001,
        maximum=1.0,
        doc="interval of the motion of driven entities and of collision checks",
    )
    building_height: float = parameter(
        BUILDING_HEIGHT, unit="m", minimum=0.1, doc="of buildings without a parameter `height`"
    )
    antenna_above_roof: float = parameter(
        0.05, unit="m", minimum=0.001, doc="of types without a parameter `antenna_height`"
    )
    program: Literal["libsumo", "sumo", "sumo-gui"] = parameter(
        "libsumo", doc="what runs SUMO: this process, or an installed program over TraCI"
    )
    traci: str = parameter(
        "", doc="join the SUMO that listens at HOST:PORT instead; `scene` is what it has loaded"
    )
