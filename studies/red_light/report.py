"""The report of a red-light run: what `nlosim run` prints and draws."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from orchestrator.recording import Recording
from orchestrator.report import Report
from studies.red_light import metrics
from studies.red_light.traces import Traces

_PARTNERS: Final = {
    "collision vehicle": "the collision vehicle",
    "blocking vehicle": "a blocking vehicle",
    "background": "a vehicle of the background",
    "sharing node": "the sharing node",
}
"""Roles of those whom the ego collides with, in a sentence."""


class RedLightReport(Report):
    """Collision, packet reception, relays, and who saw the hidden vehicle when."""

    @override
    def metrics(self, recording: Recording) -> dict[str, Any]:
        return metrics.compute(Traces(recording))

    @override
    def figure(self, recording: Recording, metrics: Mapping[str, Any], path: Path) -> None:
        from studies.red_light import figure  # noqa: PLC0415 - matplotlib takes a while

        figure.draw(Traces(recording), dict(metrics), path)

    @override
    def summary(self, metrics: Mapping[str, Any], manifest: Mapping[str, Any]) -> str:
        return "\n".join(
            [
                *_encounter(metrics),
                *_perception(metrics),
                *_radio(metrics),
            ]
        )


def _encounter(metrics: Mapping[str, Any]) -> list[str]:
    if metrics["collision"]:
        partner = _PARTNERS[metrics["collision_partner"]]
        first = f"COLLISION at {_seconds(metrics['collision_time'])} with {partner}"
    elif metrics["min_gap_m"] is None:
        first = "no collision"
    else:
        gap, time = metrics["min_gap_m"], _seconds(metrics["min_gap_time"])
        first = f"no collision, smallest gap {gap:.2f} m at {time}"
    first += f"; {_completion(metrics)}"
    braking = metrics["braking"]
    if braking["time"] is None and braking["pedal"] is not None:
        return [first, f"braking        at {_seconds(braking['pedal'])}, for nothing it names"]
    if braking["time"] is None:
        return [first, "braking        never for a hazard"]
    if braking["seen_by"] == NO_VEHICLE:  # the expert reads the truth
        return [
            first,
            f"braking        at {_seconds(braking['time'])} for vehicle {braking['object']}",
        ]
    return [
        first,
        (
            f"braking        at {_seconds(braking['time'])} for vehicle {braking['object']}, "
            f"seen by vehicle {braking['seen_by']} {braking['data_age'] * 1e3:.0f} ms before"
        ),
    ]


def _completion(metrics: Mapping[str, Any]) -> str:
    time = metrics["completion_time"]
    return "not completed" if time is None else f"completed at {_seconds(time)}"


def _perception(metrics: Mapping[str, Any]) -> list[str]:
    hidden = metrics["hidden_vehicle"]
    seen = (
        "never seen"
        if hidden["first_seen"] is None
        else f"first seen at {_seconds(hidden['first_seen'])} by the {hidden['first_seen_by']}"
    )
    return [
        (
            f"hidden vehicle {seen}; received by the ego {_moment(hidden['received_by_ego'])}, "
            f"seen by the ego itself {_moment(hidden['seen_by_ego'])}"
        )
    ]


def _radio(metrics: Mapping[str, Any]) -> list[str]:
    prr = metrics["prr"]
    lines = [
        (
            f"PRR            end to end {_percent(prr['end_to_end'])}, direct link "
            f"{_percent(prr['direct'])} ({prr['sent']} packets of sensor data; whole messages "
            f"{_percent(prr['messages'])})"
        ),
        (
            f"relays         {metrics['relay_switches']} switches; used: "
            f"{', '.join(map(str, metrics['relays'])) or 'none'}"
        ),
        f"on the air     {metrics['packets_sent']} packets, {metrics['bytes_sent'] / 1e6:.2f} MB",
    ]
    for link in metrics["links"]:
        classes = ", ".join(f"{name} {n}" for name, n in link["classes"].items() if n)
        lines.append(
            f"  link {link['transmitter']} -> {link['receiver']}: PRR {_percent(link['prr'])}, "
            f"mean {_power(link['mean_power_dbm'])}, {link['packets']} packets ({classes})"
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
