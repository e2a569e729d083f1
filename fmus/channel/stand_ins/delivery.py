"""What becomes of packets when a link model decides who receives them.

No medium access, no queues, no interference: every frame goes on the air when it is handed to
the radio, and its fate at one receiver depends on no other frame. What a link model adds is
only the verdict on one frame at its receivers.
"""

import abc
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from fmus.channel.stand_ins.airtime import frame_duration
from fmus.channel.stand_ins.busy import BusyRatio, BusyState
from fmus.channel.stand_ins.inputs import Inputs
from fmus.channel.stand_ins.packets import Frame, Waiting, WaitingState
from fmus.channel.stand_ins.parameters import RadioParameters
from fmus.channel.stand_ins.radios import Radios
from fmus.messages.records import (
    FATES,
    LINKS,
    NO_VEHICLE,
    NOISE,
    OUTCOMES,
    RECEPTION,
    TRANSMISSION,
    frame as frame_of,
)
from fmus.physics.propagation import SPEED_OF_LIGHT
from orchestrator.signal import Array, Signals
from orchestrator.timebase import Duration, Time, nanoseconds

Int: TypeAlias = npt.NDArray[np.int64]
Float: TypeAlias = npt.NDArray[np.float64]
Codes: TypeAlias = npt.NDArray[np.uint8]

RECEIVED: Final = OUTCOMES.index("R")
NOISE_LOSS: Final = OUTCOMES.index("N")
UNNOTICED: Final = OUTCOMES.index("U")
_ALL: Final = len(OUTCOMES)

_SENT: Final = FATES.index("sent")
_GONE: Final = FATES.index("gone")
_NO_RECEPTION: Final = np.empty(0, RECEPTION)


@dataclass(frozen=True, slots=True, eq=False)
class Receivers:
    """Those who may receive a frame: every radio but the transmitter.

    Attributes:
        id: numbers of the vehicles, ascending, shape (receiver,).
        distance: from the transmitter's antenna [m], shape (receiver,).
    """

    id: Int
    distance: Float


@dataclass(frozen=True, slots=True, eq=False)
class Verdicts:
    """What becomes of one frame at its receivers; every member has shape (receiver,).

    Attributes:
        outcome: indices into `OUTCOMES`.
        delay: from handing the frame to the radio to its reception [ns].
        power_dbm: NaN where it is not known.
        snir_db: NaN where it is not known or nothing was decoded.
        link: indices into `LINKS`.
    """

    outcome: Codes
    delay: Int
    power_dbm: Float
    snir_db: Float
    link: Codes

    @classmethod
    def of(cls, received: npt.NDArray[np.bool_], delay: Int) -> "Verdicts":
        """Verdicts that say who receives, and nothing of powers.

        Args:
            received: whether each receiver gets the frame, shape (receiver,); others lose it to
                noise.
            delay: from handing the frame to the radio to its reception [ns], shape (receiver,).

        Raises:
            TypeError: `received` has something else than truths.
        """
        if np.asarray(received).dtype != np.bool_:
            kind = np.asarray(received).dtype
            what = f"`received` is {kind}, not bool; compare a probability with a draw: `draws < p`"
            raise TypeError(what)
        unknown = np.full(len(received), np.nan)
        return cls(
            outcome=np.where(received, RECEIVED, NOISE_LOSS).astype(np.uint8),
            delay=delay,
            power_dbm=unknown,
            snir_db=unknown,
            link=np.full(len(received), LINKS.index("LOS"), np.uint8),
        )


class LinkModel(abc.ABC):
    """Decides who receives a frame; the base of channel models of one's own.

    `LinkModelComponent` makes a channel of it. A model judges one frame at all its receivers, and
    knows of no other: there is no interference. Of equal frames it must say the same whatever
    was judged before, unless it remembers, and then it saves and restores what it remembers.
    """

    @abc.abstractmethod
    def judge(self, frame: Frame, receivers: Receivers, usual_delay: Int) -> Verdicts:
        """The verdicts on `frame`.

        Args:
            frame: what is sent.
            receivers: who may receive it.
            usual_delay: time on air, propagation and the parameter `latency` [ns], shape
                (receiver,).
        """

    def save(self) -> Any:
        """What the model remembers of the frames it judged; a model without memory: nothing."""
        return None

    def restore(self, state: Any) -> None:
        """Return to `state`."""


@dataclass(frozen=True, slots=True)
class DeliveryState:
    """What `Delivery` and its link model know."""

    waiting: WaitingState
    pending: Array
    busy: BusyState
    model: Any


class Delivery:
    """Sends packets along their routes and collects what there is to tell.

    Args:
        parameters: of the radios.
        model: decides who receives.
        start: the first communication point [ns].
    """

    def __init__(self, parameters: RadioParameters, model: LinkModel, start: Time) -> None:
        self._parameters = parameters
        self._model = model
        self._latency = nanoseconds(parameters.latency)
        self._relay_delay = nanoseconds(parameters.relay_delay)
        self._waiting = Waiting(parameters.mac_header)
        self._pending: Array = _NO_RECEPTION
        self._busy = BusyRatio(nanoseconds(parameters.busy_window), start)

    def step(self, inputs: Inputs, t: Time, h: Duration) -> Signals:
        """The outputs after the step from `t` to `t + h` [ns]."""
        end = t + h
        radios = Radios.of(inputs)
        self._waiting.accept(inputs.packets, radios, t)
        sent, ending = [], [self._pending]
        for frame in self._waiting.due(end):
            transmission, receptions = self._send(frame, radios)
            sent.append(transmission)
            ending.append(receptions)
        self._busy.advance(end)
        return {
            "receptions": self._release(np.concatenate(ending), end),
            "transmissions": frame_of("SENT", np.array(sent, TRANSMISSION)),
            "busy_ratio": self._busy.of(inputs.id),
        }

    def save(self) -> DeliveryState:
        """The state, to be restored any number of times."""
        return DeliveryState(
            self._waiting.save(), self._pending, self._busy.save(), self._model.save()
        )

    def restore(self, state: DeliveryState) -> None:
        """Return to `state`."""
        self._waiting.restore(state.waiting)
        self._pending = state.pending
        self._busy.restore(state.busy)
        self._model.restore(state.model)

    def _release(self, receptions: Array, end: Time) -> bytes:
        """Those that have ended, as a signal; the others stay pending."""
        ended = receptions["time"] <= end
        self._pending = receptions[~ended]
        due = receptions[ended]
        order = np.lexsort([due[key] for key in ("receiver", "hop", "packet", "time")])
        return frame_of("RCPT", due[order])

    def _send(self, frame: Frame, radios: Radios) -> tuple[tuple[Any, ...], Array]:
        """The TRANSMISSION record of a frame and its receptions."""
        row = radios.row(frame.transmitter)
        if row is None:
            return _transmission(frame, 0, _GONE), _NO_RECEPTION
        duration = frame.duration or frame_duration(
            self._parameters.bitrate, frame.size + self._parameters.mac_header
        )
        told = _transmission(frame, duration, _SENT)
        if frame.kind == NOISE:  # disturbs nobody here
            return told, _NO_RECEPTION
        receivers = _receivers(radios, row)
        flight = np.rint(receivers.distance / SPEED_OF_LIGHT * 1e9).astype(np.int64)
        verdicts = self._model.judge(frame, receivers, duration + flight + self._latency)
        _refuse(verdicts, self._model, len(receivers.id))
        receptions = _receptions(frame, receivers, verdicts)
        self._pass_on(frame, receptions)
        heard = receivers.id[verdicts.outcome != UNNOTICED]
        self._busy.add(np.append(heard, frame.transmitter), frame.time, frame.time + duration)
        if not self._parameters.weak_receptions:
            receptions = receptions[receptions["outcome"] != UNNOTICED]
        return told, receptions

    def _pass_on(self, frame: Frame, receptions: Array) -> None:
        """Hand the next hop to the relay, if there is one and it received the frame."""
        if frame.is_last_hop:
            return
        at_relay = receptions[receptions["receiver"] == frame.addressee]
        for reception in at_relay[at_relay["outcome"] == RECEIVED]:
            self._waiting.add(frame.passed_on(int(reception["time"]) + self._relay_delay))


def _receivers(radios: Radios, transmitter: int) -> Receivers:
    others = np.arange(len(radios.id)) != transmitter
    offset = radios.antenna[others] - radios.antenna[transmitter]
    return Receivers(radios.id[others], np.linalg.norm(offset, axis=1))


def _transmission(frame: Frame, duration: Duration, fate: int) -> tuple[Any, ...]:
    """A TRANSMISSION record; frames go on the air when they are handed over."""
    return (
        frame.packet,
        frame.time,
        frame.time,
        frame.transmitter,
        duration,
        frame.hop,
        fate,
        frame.access_category,
        frame.kind,
    )


def _refuse(verdicts: Verdicts, model: LinkModel, count: int) -> None:
    """Raise a `TypeError` or `ValueError` if this is no verdict on each of `count` receivers."""
    name = f"`{type(model).__name__}.judge`"
    if not isinstance(verdicts, Verdicts):
        raise TypeError(f"{name} returned `{type(verdicts).__name__}`, not `Verdicts`")
    found = np.shape(verdicts.outcome)
    if found != (count,):
        raise ValueError(f"{name} judged {found} of {count} receivers: one verdict for each")
    outcome, delay = np.asarray(verdicts.outcome), np.asarray(verdicts.delay)
    if outcome.dtype.kind not in "iu" or (count and not 0 <= outcome.min() <= outcome.max() < _ALL):
        raise ValueError(f"{name}: every `outcome` is an index into `OUTCOMES`, 0 .. {_ALL - 1}")
    if delay.dtype.kind not in "iu" or (count and delay.min() < 0):
        kind = "not negative" if delay.dtype.kind in "iu" else f"no {delay.dtype}"
        raise ValueError(f"{name}: every `delay` is a whole number of nanoseconds, {kind}")


def _receptions(frame: Frame, receivers: Receivers, verdicts: Verdicts) -> Array:
    rows = np.zeros(len(receivers.id), RECEPTION)
    rows["packet"], rows["transmitter"] = frame.packet, frame.transmitter
    rows["hop"], rows["kind"] = frame.hop, frame.kind
    rows["time"] = frame.time + verdicts.delay
    rows["receiver"] = receivers.id
    rows["power_dbm"], rows["snir_db"] = verdicts.power_dbm, verdicts.snir_db
    rows["outcome"], rows["link"] = verdicts.outcome, verdicts.link
    is_broadcast = frame.addressee == NO_VEHICLE
    rows["addressed"] = is_broadcast | (receivers.id == frame.addressee)
    return rows
