"""The report of a red-light run: what `nlosim run` prints and draws."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from orchestrator.errors import ParameterProblem
from orchestrator.parameters import parameter
from orchestrator.recording import Recording
from orchestrator.report import Report
from orchestrator.suggestion import suggestion
from studies.method.records import from_json
from studies.red_light.metrics import Braking, HiddenVehicle, Metrics, compute
from studies.red_light.roles import USUAL, Names
from studies.red_light.traces import Traces

_COMPONENTS: Final = ("traffic", "perception", "channel", "facilities", "relay", "policy")
_ENTITIES: Final = ("ego", "collider", "sharer", "blocking")

_PARTNERS: Final = {
    "collision vehicle": "the collision vehicle",
    "blocking vehicle": "a blocking vehicle",
    "background": "a vehicle of the background",
    "sharing node": "the sharing node",
}
"""Roles of those whom the ego collides with, in a sentence."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RedLightReport(Report):
    """Collision, packet reception, relays, and who saw the hidden vehicle when.

    It is for every scenario in which an ego vehicle meets a hidden one; the parameters are what the
    scenario calls them, and its components.
    """

    ego: str = parameter(USUAL.ego, doc="the entity that the policy drives")
    collider: str = parameter(USUAL.collider, doc="the entity that is hidden from it")
    sharer: str = parameter(USUAL.sharer, doc="the entity that shares its sensor data")
    blocking: str = parameter(USUAL.blocking, doc="the entities between the two")
    traffic: str = parameter(USUAL.traffic, doc="the component")
    perception: str = parameter(USUAL.perception, doc="the component")
    channel: str = parameter(USUAL.channel, doc="the component")
    facilities: str = parameter(USUAL.facilities, doc="the component")
    relay: str = parameter(USUAL.relay, doc="the component")
    policy: str = parameter(USUAL.policy, doc="the component")
    received: str = parameter(
        USUAL.received, doc="what the signals begin with that the ego vehicle received"
    )

    @override
    def problems(self, components: Sequence[str]) -> Iterator[ParameterProblem]:
        for key in _COMPONENTS:
            name = getattr(self, key)
            if name not in components:
                what = f"there is no component `{name}`; {suggestion(name, components)}"
                yield ParameterProblem((key,), what)
        if self.received.partition(".")[0] not in components:
            yield ParameterProblem(("received",), f"`{self.received}` is of no component")

    @override
    def problems_with(
        self, components: Mapping[str, Mapping[str, Any]]
    ) -> Iterator[ParameterProblem]:
        entities = components.get(self.traffic, {}).get("entities") or {}
        for key in _ENTITIES:
            name = getattr(self, key)
            is_needed = key == "ego" or name != getattr(USUAL, key)
            if self.traffic in components and is_needed and name not in entities:
                what = f"`{self.traffic}` has no entity `{name}`; {suggestion(name, entities)}"
                yield ParameterProblem((key,), what)

    @override
    def metrics(self, recording: Recording) -> Mapping[str, Any]:
        return asdict(compute(self._traces(recording)))

    @override
    def figure(self, recording: Recording, metrics: Mapping[str, Any], path: Path) -> None:
        from studies.red_light import figure  # noqa: PLC0415 - matplotlib takes a while

        figure.draw(self._traces(recording), from_json(metrics, Metrics), path)

    def _traces(self, recording: Recording) -> Traces:
        return Traces(recording, Names(**asdict(self)))

    @override
    def summary(self, metrics: Mapping[str, Any], manifest: Mapping[str, Any]) -> str:
        found = from_json(metrics, Metrics)
        hidden = _perception(found.hidden_vehicle)
        return "\n".join([_encounter(found), _braking(found.braking), hidden, *_radio(found)])


def _to_any(metrics: Metrics) -> str:
    """The smallest gap to any vehicle, where the recording has it."""
    if metrics.ego_gap_m is None:
        return ""
    which = f"(vehicle {metrics.ego_gap_vehicle})"
    return f", to any {metrics.ego_gap_m:.2f} m at {_seconds(metrics.ego_gap_time)} {which}"


def _encounter(metrics: Metrics) -> str:
    if metrics.collision:
        partner = _PARTNERS.get(metrics.collision_partner or "", "another vehicle")
        first = f"COLLISION at {_seconds(metrics.collision_time)} with {partner}"
    elif metrics.min_gap_m is None:
        first = "no collision"
    else:
        time = _seconds(metrics.min_gap_time)
        first = (
            f"no collision, smallest gap to the hidden vehicle {metrics.min_gap_m:.2f} m at {time}"
            f"{_to_any(metrics)}"
        )
    completed = metrics.completion_time
    last = "not completed" if completed is None else f"completed at {_seconds(completed)}"
    return f"{first}; {last}"


def _braking(braking: Braking) -> str:
    if braking.time is None and braking.pedal is not None:
        return f"braking        at {_seconds(braking.pedal)}, for nothing it names"
    if braking.time is None:
        return "braking        never for a hazard"
    what = f"braking        at {_seconds(braking.time)} for vehicle {braking.object}"
    if braking.seen_by == NO_VEHICLE:  # the expert reads the truth
        return what
    age = 0.0 if braking.data_age is None else braking.data_age
    return f"{what}, seen by vehicle {braking.seen_by} {age * 1e3:.0f} ms before"


def _perception(hidden: HiddenVehicle) -> str:
    seen = (
        "never seen"
        if hidden.first_seen is None
        else f"first seen at {_seconds(hidden.first_seen)} by the {hidden.first_seen_by}"
    )
    return (
        f"hidden vehicle {seen}; received by the ego {_moment(hidden.received_by_ego)}, "
        f"seen by the ego itself {_moment(hidden.seen_by_ego)}"
    )


def _radio(metrics: Metrics) -> list[str]:
    prr = metrics.prr
    lines = [
        (
            f"PRR            end to end {_percent(prr.end_to_end)}, direct link "
            f"{_percent(prr.direct)} ({prr.sent} packets of sensor data; whole messages "
            f"{_percent(prr.messages)})"
        ),
        (
            f"relays         chosen: {', '.join(map(str, metrics.relays)) or 'none'}; "
            f"{metrics.relay_switches} switches (changes while fusion goes on)"
        ),
        f"on the air     {metrics.packets_sent} packets, {metrics.bytes_sent / 1e6:.2f} MB",
    ]
    for link in metrics.links:
        classes = ", ".join(f"{name} {n}" for name, n in link.classes.items() if n)
        lines.append(
            f"  link {link.transmitter} -> {link.receiver}: PRR {_percent(link.prr)}, "
            f"mean {_power(link.mean_power_dbm)}, {link.packets} packets ({classes})"
        )
    return lines


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.1f} %"


def _power(dbm: float | None) -> str:
    return "power unknown" if dbm is None else f"{dbm:.1f} dBm"


def _seconds(time: float | None) -> str:
    return "-" if time is None else f"{time:.2f} s"


def _moment(time: float | None) -> str:
    return "never" if time is None else f"at {time:.2f} s"
