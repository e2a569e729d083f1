"""Which recorded signals are what, whatever their components are called."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from fmus.messages.records import (
    APMS_MIME,
    OBJECTS_MIME,
    PACKETS_MIME,
    POINTS_MIME,
    RECEPTIONS_MIME,
    TRANSMISSIONS_MIME,
)
from orchestrator.recording.reader import Recording

_VEHICLE: Final = ".vehicle.position"


@dataclass(frozen=True, slots=True, kw_only=True)
class Sources:
    """The signals of a run that can be seen from above; empty where there is none.

    Attributes:
        traffic: the component that has the vehicles.
        egos: names of entities that have signals of their own, by the signal of their number.
        packets, receptions, transmissions: `component.connector`.
        busy: of the busy ratios.
        objects: of those who see them; then of what others were told.
        matrices, points: all of them.
        zones: what the signals of blind zones begin with.
        relays: signals of chosen relays.
    """

    traffic: str
    egos: Mapping[str, str]
    packets: str
    receptions: str
    transmissions: str
    busy: str
    objects: tuple[str, ...]
    matrices: tuple[str, ...]
    points: tuple[str, ...]
    zones: tuple[str, ...]
    relays: tuple[str, ...]


def sources_of(recording: Recording) -> Sources | None:
    """The signals of a run; `None` if it has no vehicles."""
    names = recording.signals
    traffic = next((name.removesuffix(_VEHICLE) for name in names if name.endswith(_VEHICLE)), None)
    if traffic is None or f"{traffic}.vehicle.id" not in recording:
        return None
    centers = ".blind_zone.center"
    objects = tuple(_binary(recording, OBJECTS_MIME))
    return Sources(
        traffic=traffic,
        egos=dict(_egos(recording, traffic)),
        packets=next(_binary(recording, PACKETS_MIME), ""),
        receptions=next(_binary(recording, RECEPTIONS_MIME), ""),
        transmissions=next(_binary(recording, TRANSMISSIONS_MIME), ""),
        busy=next((name for name in names if name.endswith(".busy_ratio")), ""),
        objects=tuple(sorted(objects, key=lambda name: "received" in name)),
        matrices=tuple(n for n in _binary(recording, APMS_MIME) if "received" not in n),
        points=tuple(_binary(recording, POINTS_MIME)),
        zones=tuple(n.removesuffix(".center") for n in names if n.endswith(centers)),
        relays=tuple(n for n in names if n.endswith(".relay") and recording.kind(n) == "int64[]"),
    )


def entities_of(manifest: Mapping[str, Any], traffic: str) -> list[str]:
    """The names of the declared entities, in their order: number k has the role k + 1."""
    component = manifest.get("scenario", {}).get("components", {}).get(traffic, {})
    return list((component.get("parameters") or {}).get("entities") or {})


def _binary(recording: Recording, mime: str) -> Iterator[str]:
    return (name for name in recording.signals if recording.kind(name) == f"binary ({mime})")


def _egos(recording: Recording, traffic: str) -> Iterator[tuple[str, str]]:
    """Entities whose number is a signal of its own, `traffic.NAME.id`, by that signal."""
    for name in recording.signals:
        entity = name.removeprefix(f"{traffic}.").removesuffix(".id")
        is_single = name.endswith(".id") and recording.kind(name) == "int64[]"
        if is_single and name.startswith(f"{traffic}.") and "." not in entity:
            yield name, entity
