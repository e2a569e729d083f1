"""`run.json`: the parameters of a run of the whole Veins stack, as parameters of the channel.

Models are listed as Veins names them, with their values in words, e.g. `SimplePathlossModel
alpha=2`, `TwoRayInterferenceModel eps_r=1.02 (antenna heights 1.895 m)`, `SimpleObstacleShadowing 9
dB/cut, 0.4 dB/m`. What cannot be interpreted is refused: a comparison with guessed parameters
proves nothing.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from orchestrator.timebase import Duration, Time
from studies.verification.channel.golden_files import Node
from studies.verification.channel.reception import BITRATES
from studies.verification.channel.session import VEINS_ANTENNA_HEIGHT

_NUMBER: Final = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
_BREAKPOINT: Final = {
    "l01": "breakpoint_near_loss",
    "l02": "breakpoint_far_loss",
    "alpha1": "path_loss_exponent",
    "alpha2": "breakpoint_far_exponent",
    "breakpointdistance": "breakpoint_distance",
}
_MODELS: Final = (
    "SimplePathlossModel, TwoRayInterferenceModel, BreakpointPathlossModel, "
    "SimpleObstacleShadowing, VehicleObstacleShadowing"
)
_ACCESS_CATEGORIES: Final = {"AC_BK": 0, "AC_BE": 1, "AC_VI": 2, "AC_VO": 3}


@dataclass(frozen=True, slots=True, kw_only=True)
class RunParameters:
    """What `run.json` says.

    Attributes:
        channel: parameters of the channel, but for the medium access.
        models: as listed.
        versions: of Veins and what it ran on.
        access_category: of every packet, 0..3.
        size: of every packet [byte].
        interval: between updates of the positions [ns].
        end: of the simulation; frames on air then are in no total and no event [ns].
        events: arrivals from this time on, before that time, are in `rx_events.csv.gz` [ns].
        totals: of each outcome over the whole run.
    """

    channel: Mapping[str, Any]
    models: tuple[str, ...]
    versions: Mapping[str, str]
    access_category: int
    size: int
    interval: Duration
    end: Time
    events: tuple[Time, Time]
    totals: Mapping[str, int]


def run_parameters(node: Node) -> RunParameters:
    """Interpret `run.json`.

    Raises:
        GoldenError: it is malformed, or says something that the channel cannot be set to.
    """
    _refuse_other_conventions(node)
    models = list(node["models"])
    events = node["rx_events_cover_s"].numbers(2)
    return RunParameters(
        channel={
            "model": "veins",
            "carrier_frequency": node["center_hz"].positive(),
            "transmit_power": node["tx_power_dbm"].number(),
            "noise_floor": node["noise_floor_dbm"].number(),
            "sensitivity": node["min_power_level_dbm"].number(),
            "cca_threshold": node["cca_threshold_dbm"].number(),
            "bitrate": _bitrate(node["bitrate_bps"]),
            "maximum_range": node["max_interference_distance_m"].positive(),
            **_propagation(node["models"], models),
        },
        models=tuple(model.text() for model in models),
        versions={name: node[name].text() for name in ("veins", "omnetpp", "sumo") if name in node},
        access_category=_access_category(node["access_category"]),
        size=_size(node["mpdu_bits"]),
        interval=_nanoseconds(node["update_interval_s"].positive()),
        end=_nanoseconds(node["sim_time_s"].positive()),
        events=(_nanoseconds(events[0]), _nanoseconds(events[1])),
        totals=_totals(node["outcome_totals"]),
    )


def _nanoseconds(seconds: float) -> int:
    return round(seconds * 1e9)


def _bitrate(node: Node) -> float:
    bitrate = node.number()
    if bitrate not in BITRATES:
        rates = ", ".join(f"{rate:g}" for rate in BITRATES)
        raise node.problem(f"{bitrate:g} is no rate of a 10 MHz channel; there are: {rates}")
    return bitrate


def _size(node: Node) -> int:
    bits = node.whole()
    if bits <= 0 or bits % 8:
        raise node.problem(f"{bits} bits are no whole number of bytes")
    return bits // 8


def _access_category(node: Node) -> int:
    name = node.text()
    if name not in _ACCESS_CATEGORIES:
        raise node.problem(f"`{name}` is not known; there are: {', '.join(_ACCESS_CATEGORIES)}")
    return _ACCESS_CATEGORIES[name]


def _totals(node: Node) -> dict[str, int]:
    return {outcome: node[outcome].whole() if outcome in node else 0 for outcome in "RNCBTU"}


def _propagation(where: Node, models: list[Node]) -> dict[str, Any]:
    """The parameters that the list of models says."""
    found: dict[str, Any] = {"building_shadowing": False, "vehicle_shadowing": False}
    for model in models:
        new = _model(model)
        if "path_loss" in new and "path_loss" in found:
            raise model.problem("there is another path-loss model in the list")
        found |= new
    if "path_loss" not in found:
        raise where.problem("there is no path-loss model in the list")
    return found


def _model(node: Node) -> dict[str, Any]:
    name, _, words = node.text().strip().partition(" ")
    values = {
        key.lower(): float(value) for key, value in re.findall(rf"(\w+)\s*=\s*{_NUMBER}", words)
    }
    match name.lower():
        case "simplepathlossmodel":
            return {"path_loss": "exponent", "path_loss_exponent": values.get("alpha", 2.0)}
        case "tworayinterferencemodel":
            return {"path_loss": "two_ray", "permittivity": _permittivity(node, values)}
        case "breakpointpathlossmodel":
            return {"path_loss": "breakpoint", **_breakpoint(node, values)}
        case "simpleobstacleshadowing":
            return {"building_shadowing": True, **_walls(node, words)}
        case "vehicleobstacleshadowing":
            return {"vehicle_shadowing": True}
        case _:
            raise node.problem(
                f"this run cannot be interpreted: `{name}` is not known; there are: {_MODELS}"
            )


def _permittivity(node: Node, values: Mapping[str, float]) -> float:
    for name in ("eps_r", "epsilon_r", "dielectricconstant"):
        if name in values:
            return values[name]
    raise node.problem("this run cannot be interpreted: `eps_r=NUMBER` is missing")


def _breakpoint(node: Node, values: Mapping[str, float]) -> dict[str, float]:
    if missing := [name for name in _BREAKPOINT if name not in values]:
        raise node.problem(
            f"this run cannot be interpreted: `{missing[0]}=NUMBER` is missing (upper and lower "
            "case are the same)"
        )
    return {parameter: values[name] for name, parameter in _BREAKPOINT.items()}


def _walls(node: Node, words: str) -> dict[str, float]:
    wall = re.search(rf"{_NUMBER}\s*dB\s*(?:/|per\s)\s*(?:cut|wall)", words, re.IGNORECASE)
    indoors = re.search(
        rf"{_NUMBER}\s*dB\s*(?:/|per\s)\s*m(?:et(?:er|re))?\b", words, re.IGNORECASE
    )
    if wall is None or indoors is None:
        raise node.problem(
            "this run cannot be interpreted: write `SimpleObstacleShadowing 9 dB/cut, 0.4 dB/m`"
        )
    return {"wall_loss": float(wall[1]), "indoor_loss": float(indoors[1])}


def _refuse_other_conventions(node: Node) -> None:
    """Refuse what `model: veins` does not stand for."""
    for name, needed in (("propagation_delay", True), ("set_host_speed", False)):
        if name in node and node[name].value is not needed:
            raise node[name].problem(f"this run cannot be interpreted: must be {needed}")
    if "antenna" not in node:
        return
    antenna = node["antenna"]
    text = antenna.text()
    height = re.search(rf"z\s*=\s*{_NUMBER}\s*m", text)
    offset = re.search(rf"hostPositionOffset\s*=?\s*{_NUMBER}", text)
    if (
        not re.match(r"isotropic(?:\s+0(?:\.0*)?\s*dBi)?\b", text)
        or (height is not None and float(height[1]) != VEINS_ANTENNA_HEIGHT)
        or (offset is not None and float(offset[1]) != 0)
    ):
        raise antenna.problem(
            "this run cannot be interpreted: antennas must be isotropic, 0 dBi, "
            f"z={VEINS_ANTENNA_HEIGHT} m, hostPositionOffset 0"
        )
