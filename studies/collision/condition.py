"""Under which condition a run was made, read from its scenario."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from orchestrator.scenario.units import parse_quantity

POLICY: Final = "policy"
"""The factor whose levels are driving policies; an experiment may have a single one without it."""

COOPERATIVE: Final = "cooperative"
"""The policy that drives by features; its levels are called `cooperative-16`, `cooperative-32`."""

EXPERT: Final = "expert"
"""The policy with full knowledge, by whose times completion is measured."""

CONSTANT: Final = "constant"
SIMULATED: Final = "simulated"
"""Channels: one that loses frames at a constant rate, and all others."""

USUAL_AGE: Final = 1.0
"""What the cooperative policy remembers unless an experiment is about that [s]."""

USUAL_POWER: Final = 26.0
"""Of every radio unless an experiment is about that [dBm]."""

_CONSTANT_TYPE: Final = "channel-constant-per"


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """What runs that are counted together have in common.

    Attributes:
        policy: of driving; `cooperative` whatever the compression.
        relay: method; `random` is the component type `relay-random`.
        compression: of the features that the policy drives by; `None` if it does not.
        speed_kmh: of the ego [km/h].
        channel: `constant` or `simulated`.
        per: packet error rate that is set at a constant channel, 0 to 1; `None` at others.
        load: `probe`, `full`, or empty where facilities have none (CPMs).
        granularity: of losses (`loss_granularity`): `frame`, `packets`, `keypoint`, or empty.
        maximum_age: up to which the policy uses features [s]; `None` if it does not drive by them.
        transmit_power: of every radio [dBm]; `None` at a constant channel, which has none.
    """

    policy: str
    relay: str
    compression: int | None
    speed_kmh: float
    channel: str
    per: float | None
    load: str
    granularity: str
    maximum_age: float | None
    transmit_power: float | None


def condition_of(levels: Mapping[str, str], scenario: Mapping[str, Any], policy: str) -> Condition:
    """The condition of a combination of levels.

    Args:
        levels: by factor.
        scenario: resolved; its quantities are in SI units.
        policy: the name of the driving policy if no factor is.

    Raises:
        ValueError: the scenario lacks a component that tells the condition.
    """
    name = levels.get(POLICY, policy)
    drives_by_features = name == COOPERATIVE or name.startswith(f"{COOPERATIVE}-")
    sharing, channel = _component(scenario, "facilities"), _component(scenario, "channel")
    parameters = sharing["parameters"]
    is_constant = channel.get("type") == _CONSTANT_TYPE
    return Condition(
        policy=COOPERATIVE if drives_by_features else name,
        relay=str(_component(scenario, "relay").get("type")).removeprefix("relay-"),
        compression=int(parameters["compression"]) if drives_by_features else None,
        speed_kmh=round(_quantity(scenario, "traffic", "ego_speed") * 3.6, 6),
        channel=CONSTANT if is_constant else SIMULATED,
        per=float(channel["parameters"]["per"]) if is_constant else None,
        load=str(parameters.get("load", "")),
        granularity=str(parameters.get("loss_granularity", "")),
        maximum_age=_quantity(scenario, "policy", "maximum_age") if drives_by_features else None,
        transmit_power=None if is_constant else _power(scenario),
    )


def _component(scenario: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    try:
        found: Mapping[str, Any] = scenario["components"][name]
    except KeyError:
        what = f"the scenario has no component `{name}`, which tells the condition of a run"
        raise ValueError(what) from None
    return found


def _power(scenario: Mapping[str, Any]) -> float:
    """Of the radios [dBm], in which scenarios are resolved."""
    text = _parameter(scenario, "channel", "transmit_power")
    return float(parse_quantity(text).number)


def _quantity(scenario: Mapping[str, Any], component: str, name: str) -> float:
    """In its SI unit."""
    return float(parse_quantity(_parameter(scenario, component, name)).number)


def _parameter(scenario: Mapping[str, Any], component: str, name: str) -> Any:
    parameters = _component(scenario, component)["parameters"]
    if name not in parameters:
        raise ValueError(
            f"the component `{component}` has no parameter `{name}`, "
            "which tells the condition of a run"
        )
    return parameters[name]
