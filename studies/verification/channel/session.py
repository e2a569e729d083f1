"""The channel FMU as the orchestrator drives it; vehicles, buildings and links as its inputs."""

from collections.abc import Mapping, Sequence
from typing import Any, Final, Self, cast

import numpy as np
import numpy.typing as npt

from fmus.messages.records import NO_VEHICLE, RECEPTION, TRANSMISSION, frame, unframe
from orchestrator.errors import ComponentError
from orchestrator.parameters import ComponentType
from orchestrator.signal import Array, Causality, Signal, Signals
from orchestrator.timebase import Duration, Time

MILLISECOND: Final = 1_000_000
MICROSECOND: Final = 1_000
VEINS_ANTENNA_HEIGHT: Final = 1.895
"""Height of the antenna of every vehicle in Veins, its parameter `antennaOffsetZ` [m]."""
_NAME: Final = "channel"


class ChannelUnderTest:
    """Makes instances of the channel.

    Args:
        component_type: what is installed under the name `channel`.
    """

    def __init__(self, component_type: ComponentType) -> None:
        self._type = component_type

    def start(
        self, parameters: Mapping[str, Any], inputs: Signals | None = None, *, at: Time = 0
    ) -> "Session":
        """Make and initialise a new instance.

        Args:
            parameters: those that differ from their defaults; choices by the name of the item.
            inputs: those that differ from their start values.
            at: the first communication point [ns].
        """
        return Session(self._type, {"seed": 1, **parameters}, inputs or {}, at)


class Session:
    """One instance between its initialisation and its end; use it in a `with` statement.

    Whatever the instance raises becomes a `ComponentError` with the time.
    """

    def __init__(
        self, component_type: ComponentType, values: Mapping[str, Any], inputs: Signals, at: Time
    ) -> None:
        self._time = at
        try:
            self._component = component_type.create(_NAME, values)
        except Exception as error:
            raise ComponentError(_NAME, None, str(error)) from error
        self._inputs: dict[str, Signal] = {
            name: connector.start_value()
            for name, connector in self._component.connectors.items()
            if connector.causality is Causality.INPUT
        }
        self._change(inputs)
        try:
            self._component.setup(at, np.random.default_rng(0))
            self._component.initialise(self._inputs)
        except Exception as error:
            self._component.close()
            raise ComponentError(_NAME, at, str(error)) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._component.close()

    def _change(self, inputs: Signals) -> None:
        for name, value in inputs.items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            self._inputs[name] = value

    def step(self, inputs: Signals, h: Duration = MILLISECOND) -> None:
        """Advance by `h` [ns] with these inputs; those not given stay as they are."""
        self._change(inputs)
        try:
            self._component.step(self._inputs, self._time, h)
        except Exception as error:
            raise ComponentError(_NAME, self._time, str(error)) from error
        self._time += h

    def send(self, packets: Array, inputs: Signals | None = None, *, h: Duration) -> Array:
        """Advance by `h` [ns] with packets on the air, and tell what was received.

        Args:
            packets: PACKET records, shape (packet,).
            inputs: other inputs that change.
            h: until the next communication point [ns].

        Returns:
            RECEPTION records, shape (reception,).
        """
        self.step({**(inputs or {}), "packets": frame("PKTS", packets)}, h)
        return self.receptions()

    def receptions(self) -> Array:
        """The RECEPTION records of the last step, shape (reception,)."""
        return unframe("RCPT", self._binary("receptions"), RECEPTION)

    def transmissions(self) -> Array:
        """The TRANSMISSION records of the last step, shape (transmission,)."""
        return unframe("SENT", self._binary("transmissions"), TRANSMISSION)

    def probed(self, name: str) -> Array:
        """The output `probe.<name>` in the unit it has there, shape (probe,)."""
        return cast("Array", self._component.outputs()[f"probe.{name}"])

    def _binary(self, name: str) -> bytes:
        return cast("bytes", self._component.outputs()[name])


def vehicle_inputs(
    ids: npt.ArrayLike,
    front: npt.ArrayLike,
    heading: npt.ArrayLike,
    size: npt.ArrayLike,
    offset: npt.ArrayLike = 0.0,
) -> dict[str, Array]:
    """Equipped vehicles as inputs of the channel.

    Args:
        ids: numbers of the vehicles, ascending, shape (n,).
        front: a point on the axis of each body [m], shape (n, 2).
        heading: counter-clockwise from x [rad], shape (n,).
        size: length, width, height [m], shape (n, 3).
        offset: how far `front` is behind the front bumper [m], shape (n,) or one for all; Veins:
            `hostPositionOffset`.
    """
    number = np.asarray(ids, np.int64)
    n = len(number)
    angle, body = np.asarray(heading, float), np.asarray(size, float).reshape(n, 3)
    behind = body[:, 0] / 2 - np.asarray(offset, float)
    axis = np.stack([np.cos(angle), np.sin(angle)], axis=-1).reshape(n, 2)
    position = np.zeros((n, 3))
    position[:, :2] = np.asarray(front, float).reshape(n, 2) - behind[:, None] * axis
    return {
        "vehicle.id": number,
        "vehicle.position": position,
        "vehicle.heading": angle,
        "vehicle.size": body,
        "vehicle.antenna_height": np.full(n, VEINS_ANTENNA_HEIGHT),
        "vehicle.equipped": np.full(n, fill_value=True),
    }


def building_inputs(rings: Sequence[npt.ArrayLike]) -> dict[str, Array]:
    """Buildings as inputs of the channel.

    Args:
        rings: corners of each building [m], open, shape (corner, 2) each.
    """
    corners = [np.asarray(ring, float).reshape(-1, 2) for ring in rings]
    owners = [np.full(len(ring), k, np.int32) for k, ring in enumerate(corners)]
    return {
        "building.vertex": np.concatenate([np.empty((0, 2)), *corners]),
        "building.index": np.concatenate([np.empty(0, np.int32), *owners]),
        "building.height": np.full(len(rings), 10.0),
    }


def link_inputs(
    transmitter: npt.ArrayLike,
    receiver: npt.ArrayLike,
    carrier: npt.ArrayLike | None = None,
    size: npt.ArrayLike = 200,
) -> dict[str, Array]:
    """Links that are to be probed, as inputs of the channel.

    Args:
        transmitter: antennas at the one end [m], shape (n, 3).
        receiver: antennas at the other end [m], shape (n, 3).
        carrier: ids of the vehicles that carry them, shape (n, 2); none if not given.
        size: of a packet [byte], shape (n,) or one for all.
    """
    tx: Array = np.asarray(transmitter, float).reshape(-1, 3)
    n = len(tx)
    nobody = np.full((n, 2), NO_VEHICLE)
    return {
        "probe.transmitter": tx,
        "probe.receiver": np.asarray(receiver, float).reshape(n, 3),
        "probe.carrier": np.array(nobody if carrier is None else carrier, np.int64).reshape(n, 2),
        "probe.size": np.array(np.broadcast_to(size, n), np.uint32),
    }
