"""The condition under which a run was made, read from its scenario, and what readers call it."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields
from typing import Any, Final

from orchestrator.units import parse_quantity

POLICY: Final = "policy"
"""The factor whose levels are driving policies; an experiment may have a single one without it, and
then says by the parameter of that name which one it is."""

COOPERATIVE: Final = "cooperative"
"""The policy that drives by features; its levels are called `cooperative-16`, `cooperative-32`."""

HELD: Final = "cooperative, brake held"
"""The policy that drives by features and keeps to its brake for a while."""

BY_FEATURES: Final = COOPERATIVE, HELD
"""Policies that drive by features."""

EXPERT: Final = "expert"
"""The policy with full knowledge, by whose times completion is measured."""

CONSTANT: Final = "constant"
SIMULATED: Final = "simulated"
"""The channels: one that loses frames at a constant rate, and all others."""

PROBE: Final = "probe"
FRAME: Final = "frame"
DIRECT: Final = "direct"
"""The load, the loss granularity and the relay method of the paper's constant rates."""

USUAL_AGE: Final = 1.0
"""What the cooperative policy remembers unless an experiment is about that [s]."""

USUAL_POWER: Final = 26.0
"""The transmit power of every radio unless an experiment is about that [dBm]."""

_CONSTANT_TYPE: Final = "channel-constant-per"

_POLICIES: Final = {
    EXPERT: "expert, sees everything",
    "blind": "blind, network",
    "blind-rule": "blind, rules",
    "rule-based": "rules, shared objects",
    "object-list": "rules, CPMs",
    "early-fusion": "early fusion",
    COOPERATIVE: "cooperative",
    HELD: "cooperative, brake held",
}
"""What readers call policies."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """What runs that are counted together have in common.

    Attributes:
        policy: the driving policy; `cooperative`, or `cooperative, brake held`, whatever the
            compression.
        relay: the relay method; `random` is the component type `relay-random`, and
            `mohed-trajectories` is `relay-mohed` with predicted trajectories.
        compression: that of the features that the policy drives by; `None` if it does not.
        speed_kmh: the speed of the ego [km/h].
        channel: `constant` or `simulated`.
        per: packet error rate that is set at a constant channel, 0 to 1; `None` at others.
        load: `probe`, `full`, or empty where facilities have none (CPMs).
        granularity: what a loss takes: `frame`, `packets`, `keypoint`, or empty.
        maximum_age: up to which the policy uses features [s]; `None` if it does not drive by them.
        transmit_power: that of every radio [dBm]; `None` at a constant channel, which has none.
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

    @property
    def is_usual(self) -> bool:
        """Whether one packet stands for a message, as in the paper (load `probe`), at its power."""
        return (
            self.load == PROBE
            and self.granularity in (FRAME, "")
            and self.transmit_power in (None, USUAL_POWER)
        )

    def repeated_in(self, row: type, *, but: Collection[str] = ()) -> dict[str, Any]:
        """What a row of a table repeats of the condition, by name.

        Args:
            row: its type, a dataclass.
            but: fields that mean something else there.
        """
        names = {field.name for field in fields(row)}.difference(but)
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name in names}


def condition_of(levels: Mapping[str, str], scenario: Mapping[str, Any], policy: str) -> Condition:
    """The condition of a combination of levels.

    Args:
        levels: the level of every factor.
        scenario: a resolved one; its quantities are in SI units.
        policy: the name of the driving policy if no factor is.

    Raises:
        ValueError: the scenario lacks what tells the condition, or leaves it to chance.
    """
    name = levels.get(POLICY, policy)
    drives_by_features = name == COOPERATIVE or name.startswith(f"{COOPERATIVE}-")
    if drives_by_features:
        name = HELD if _holds_its_brake(scenario) else COOPERATIVE
    sharing, channel = _component(scenario, "facilities"), _component(scenario, "channel")
    parameters = sharing["parameters"]
    is_constant = channel.get("type") == _CONSTANT_TYPE
    return Condition(
        policy=name,
        relay=_method(_component(scenario, "relay")),
        compression=int(parameters["compression"]) if drives_by_features else None,
        speed_kmh=round(_speed(scenario) * 3.6, 6),
        channel=CONSTANT if is_constant else SIMULATED,
        per=float(channel["parameters"]["per"]) if is_constant else None,
        load=str(parameters.get("load", "")),
        granularity=str(parameters.get("loss_granularity", "")),
        maximum_age=_quantity(scenario, "policy", "maximum_age") if drives_by_features else None,
        transmit_power=None if is_constant else _power(scenario),
    )


def policy_key(policy: str, compression: int | None) -> str:
    """What the level of a policy is called: `cooperative-16`."""
    return f"{policy}-{compression}" if compression else policy


def policy_name(policy: str, compression: int | None) -> str:
    """What readers call a policy."""
    name = _POLICIES.get(policy, policy)
    return f"{name}, compression {compression}" if compression else name


def load_name(load: str, granularity: str) -> str:
    """What readers call a load with the loss granularity."""
    return ", ".join(filter(None, (load, granularity)))


def _component(scenario: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    try:
        found: Mapping[str, Any] = scenario["components"][name]
    except KeyError:
        what = f"the scenario has no component `{name}`, which tells the condition of a run"
        raise ValueError(what) from None
    return found


def _method(relay: Mapping[str, Any]) -> str:
    name = str(relay.get("type")).removeprefix("relay-")
    is_ahead = relay.get("parameters", {}).get("trajectories", False)
    return f"{name}-trajectories" if is_ahead else name


def _speed(scenario: Mapping[str, Any]) -> float:
    """The speed of the ego at the start [m/s].

    Raises:
        ValueError: nobody says it, or it is drawn.
    """
    entities = _parameter(scenario, "traffic", "entities")
    if entities.get("ego") is None:
        what = "the component `traffic` has no entity `ego`, which tells the condition of a run"
        raise ValueError(what)
    match entities["ego"]["speed"]:
        case str(quantity):
            return float(parse_quantity(quantity).number)
        case drawn:
            raise ValueError(
                f"the speed of the entity `ego` is drawn from {drawn}; runs are counted together "
                "where it is the same: write a single one, for example 30 km/h"
            )


def _power(scenario: Mapping[str, Any]) -> float:
    """The power of the radios [dBm], in which scenarios are resolved."""
    text = _parameter(scenario, "channel", "transmit_power")
    return float(parse_quantity(text).number)


def _holds_its_brake(scenario: Mapping[str, Any]) -> bool:
    held = _component(scenario, "policy")["parameters"].get("brake_hold", "0")
    return float(parse_quantity(held).number) > 0


def _quantity(scenario: Mapping[str, Any], component: str, name: str) -> float:
    """A parameter in its SI unit."""
    return float(parse_quantity(_parameter(scenario, component, name)).number)


def _parameter(scenario: Mapping[str, Any], component: str, name: str) -> Any:
    parameters = _component(scenario, component)["parameters"]
    if name not in parameters:
        raise ValueError(
            f"the component `{component}` has no parameter `{name}`, "
            "which tells the condition of a run"
        )
    return parameters[name]
