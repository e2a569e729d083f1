"""Collective perception messages (CPM): contents, and their encoding in bits.

A CPM of ETSI TS 103 324 V2.1.1 says where its sender is and which objects it perceives. What is
not in the message is not known to its receiver: every value goes through the resolution of its
data element in ETSI TS 102 894-2 V2.1.1. `cpm.asn` declares the wire format, and asn1tools
encodes it by the unaligned packed encoding rules (UPER).
"""

import functools
import importlib
import importlib.resources
import importlib.util
import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fmus.facilities.georeference import from_geographic, to_geographic
from fmus.facilities.perceived_object import TIME_STEP, round_up, to_element, to_record
from fmus.messages.records import OBJECT
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Array
from orchestrator.timebase import Time

RANGE_STEP: Final = 0.1
"""Resolution of the radius that a sensor sees [m] (StandardLength12b)."""
HEADING_STEP: Final = 0.1
"""Resolution of the sender's heading [deg] (Wgs84AngleValue)."""

MOST_OBJECTS: Final = 255
"""Objects in one container (PerceivedObjects, SIZE (0..255))."""
MOST_SEGMENTS: Final = 8
"""Messages of one generation event (MessageSegmentationInfo, CardinalNumber3b)."""

_START: Final = 662_774_405_000
"""The simulation's time 0 on the clock of TimestampIts, milliseconds of TAI since 2004: 2025-01-01
in UTC."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """Which part of a message that did not fit into one packet; `number` counts from 1."""

    number: int
    total: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cpm:
    """One collective perception message.

    Attributes:
        station: the sender, a vehicle.
        time: of generation [ns].
        position: of the sender, world frame [m], shape (2,).
        heading: of the sender, counter-clockwise from east [rad].
        objects: `OBJECT` records of shape (object,). The message carries neither `points` (0 when
            decoded) nor more than the last 16 bits of `instance`.
        ages: how long each object has been tracked [ns], shape (object,); at most 2.047 s is
            sent.
        perceived: number of objects the sender perceives, sent or not.
        sensor_range: radius that the lidar sees [m]; None: without sensor information.
        segment: None if the message is in one piece.
    """

    station: int
    time: Time
    position: Array
    heading: float
    objects: Array
    ages: Array
    perceived: int
    sensor_range: float | None = None
    segment: Segment | None = None


def require_codec() -> None:
    """Raise ComponentTypeError if asn1tools is not installed."""
    if importlib.util.find_spec("asn1tools") is None:
        raise ComponentTypeError(
            "collective perception messages need the extra `cpm`: pip install 'nlosim[cpm]'; "
            "or write `type: facilities` or `type: facilities-always-on`"
        )


def encode(cpm: Cpm) -> bytes:
    """The message on the air, without lower layers.

    Raises:
        ComponentTypeError: asn1tools is not installed.
    """
    codec = _codec()
    latitude, longitude = to_geographic(cpm.position)
    management: dict[str, Any] = {
        "referenceTime": cpm.time // TIME_STEP + _START,
        "referencePosition": {
            "latitude": latitude,
            "longitude": longitude,
            "positionConfidenceEllipse": {
                "semiMajor": 4095,
                "semiMinor": 4095,
                "orientation": 3601,
            },
            "altitude": {"altitudeValue": 800001, "altitudeConfidence": 15},
        },
    }
    if cpm.segment is not None:
        management["segmentationInfo"] = {
            "totalMsgNo": cpm.segment.total,
            "thisMsgNo": cpm.segment.number,
        }
    containers = [_container("OriginatingVehicleContainer", _vehicle(cpm))]
    if cpm.sensor_range is not None:
        containers.append(_container("SensorInformationContainer", [_sensor(cpm.sensor_range)]))
    if len(cpm.objects):
        containers.append(_container("PerceivedObjectContainer", _objects(cpm)))
    header = {"protocolVersion": 2, "messageId": 14, "stationId": cpm.station % 2**32}
    payload = {"managementContainer": management, "cpmContainers": containers}
    message = {"header": header, "payload": payload}
    return bytes(codec.encode("CollectivePerceptionMessage", message))


class CpmError(ValueError):
    """The bytes are no collective perception message, or not one of those that are sent here."""


def decode(message: bytes) -> Cpm:
    """What a receiver knows from `message`.

    Raises:
        ComponentTypeError: asn1tools is not installed.
        CpmError: it is damaged, or lacks what messages of this study have.
    """
    codec = _codec()
    try:
        return _decoded(codec, message)
    except Exception as error:  # asn1tools raises IndexError, OverflowError and others, too
        raise CpmError(f"no collective perception message: {error!r}") from error


def _decoded(codec: Any, message: bytes) -> Cpm:
    found = codec.decode("CollectivePerceptionMessage", message)
    station, payload = found["header"]["stationId"], found["payload"]
    management = payload["managementContainer"]
    where = management["referencePosition"]
    parts = {
        _NAMES[c["containerId"]]: codec.decode(_NAMES[c["containerId"]], c["containerData"])
        for c in payload["cpmContainers"]
    }
    sensors = parts.get("SensorInformationContainer")
    perceived = parts.get("PerceivedObjectContainer", {})
    rows = perceived.get("perceivedObjects", [])
    part = management.get("segmentationInfo")
    time = (management["referenceTime"] - _START) * TIME_STEP
    position = from_geographic(where["latitude"], where["longitude"])
    angle = parts["OriginatingVehicleContainer"]["orientationAngle"]["value"] * HEADING_STEP
    return Cpm(
        station=station,
        time=time,
        position=position,
        heading=math.radians(90.0 - angle),
        objects=np.array([to_record(row, station, time, position) for row in rows], OBJECT),
        ages=np.array([row["objectAge"] for row in rows], np.int64) * TIME_STEP,
        perceived=perceived.get("numberOfPerceivedObjects", 0),
        sensor_range=sensors[0]["perceptionRegionShape"][1]["radius"] * RANGE_STEP
        if sensors
        else None,
        segment=Segment(number=part["thisMsgNo"], total=part["totalMsgNo"]) if part else None,
    )


@functools.cache
def longest(objects: int) -> int:
    """Bytes of a message with this many objects and all else that a message can carry."""
    content = Cpm(
        station=0,
        time=0,
        position=np.zeros(2),
        heading=0.0,
        objects=np.zeros(objects, OBJECT),
        ages=np.zeros(objects, np.int64),
        perceived=objects,
        sensor_range=1.0,
        segment=Segment(number=1, total=2),
    )
    return len(encode(content))


_CONTAINERS: Final = {
    "OriginatingVehicleContainer": 1,
    "SensorInformationContainer": 3,
    "PerceivedObjectContainer": 5,
}
_NAMES: Final = {number: name for name, number in _CONTAINERS.items()}


def _container(name: str, value: object) -> dict[str, object]:
    return {"containerId": _CONTAINERS[name], "containerData": _codec().encode(name, value)}


def _vehicle(cpm: Cpm) -> dict[str, object]:
    north_based = (90.0 - math.degrees(cpm.heading)) % 360.0
    value = round_up(north_based, HEADING_STEP) % 3600
    return {"orientationAngle": {"value": value, "confidence": 127}}


def _sensor(radius: float) -> dict[str, object]:
    return {
        "sensorId": 1,
        "sensorType": 2,  # lidar
        "perceptionRegionShape": ("circular", {"radius": round_up(radius, RANGE_STEP, 0, 4095)}),
        "shadowingApplies": True,
    }


def _objects(cpm: Cpm) -> dict[str, object]:
    reference = from_geographic(*to_geographic(cpm.position))
    rows = [
        to_element(row, int(age), cpm.time // TIME_STEP * TIME_STEP, reference)
        for row, age in zip(cpm.objects, cpm.ages, strict=True)
    ]
    count = min(cpm.perceived, MOST_OBJECTS)
    return {"numberOfPerceivedObjects": count, "perceivedObjects": rows}


@functools.cache
def _codec() -> Any:
    """The compiled `cpm.asn`; 0.06 s at first use."""
    require_codec()
    text = importlib.resources.files(__package__).joinpath("cpm.asn").read_text("utf-8")
    return importlib.import_module("asn1tools").compile_string(text, "uper")
