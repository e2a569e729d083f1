"""Where nodes were last heard."""

from dataclasses import replace
from itertools import count, repeat

from fmus.messages.apm import read_header, split
from fmus.relay.inputs import Inputs
from fmus.relay.nodes import Bsms, Node
from orchestrator.signal import Array
from orchestrator.timebase import Time, seconds


class Whereabouts:
    """Where nodes were last heard.

    A sharer whose own BSMs are shadowed is still known: its APMs, which come over the
    relay, carry its position.
    """

    def __init__(self) -> None:
        self._last: dict[int, tuple[Time, Bsms, int]] = {}
        self._apms: object = None
        self._told: dict[int, tuple[Time, Array]] = {}

    def update(self, known: Inputs, now: Time) -> None:
        """Take in the BSMs and APMs that the ego holds at `now` [ns]."""
        bsms = known.bsms
        rows = zip(repeat(now), repeat(bsms), count(), strict=False)
        self._last.update(zip(bsms.vehicle.tolist(), rows, strict=False))
        if known.apms is not self._apms:
            self._apms = known.apms
            for header in map(read_header, split(known.apms)):
                self._told[int(header["vehicle"])] = (int(header["time"]), header["position"])

    def of(self, vehicle: int, now: Time) -> Node | None:
        """The last that is known of `vehicle`, moved on to `now` [ns]; None if no BSM ever came.

        The position is that of the newer message, BSM or APM.
        """
        if vehicle not in self._last:
            return None
        read_at, bsms, row = self._last[vehicle]
        node = bsms.node(row, seconds(now - read_at))
        if vehicle not in self._told:
            return node
        time, position = self._told[vehicle]
        if time <= read_at - round(float(bsms.age[row]) * 1e9):
            return node
        return replace(node, position=position + seconds(now - time) * node.velocity)
