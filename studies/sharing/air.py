"""What is on the air for each kind of message."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from fmus.messages.records import FATES, TRANSMISSION
from orchestrator import Measure
from orchestrator.measure import Findings
from orchestrator.parameters import parameter
from orchestrator.recording.reader import Recording
from studies.measures.delivery import unique_packets
from studies.measures.radio import KINDS, table_of

_SENT = FATES.index("sent")


@dataclass(frozen=True, slots=True, kw_only=True)
class OnAir(Measure):
    """Bytes that go on the air per second, by the kind of the message.

    Every frame that a radio sends counts, those of relays too; frames that were given up do not.
    Bytes are those of the packet, without the headers of MAC and LLC. `sharing` is all but basic
    safety messages. Seconds are those of the recording.
    """

    packets: str = parameter("facilities.packets", doc="`component.connector`")
    transmissions: str = parameter("channel.transmissions", doc="`component.connector`")

    @override
    def signals(self) -> Sequence[str]:
        return (self.packets, self.transmissions)

    @override
    def compute(self, recording: Recording) -> Findings:
        packets = unique_packets(recording, self.packets)
        frames = table_of(recording, self.transmissions, "SENT", TRANSMISSION).records
        times = recording[self.transmissions].times
        duration = float(times[-1] - times[0]) * 1e-9 if len(times) > 1 else 0.0
        wanted = frames["packet"]
        place = np.searchsorted(packets["id"], wanted)
        is_known = place < len(packets)
        is_known[is_known] = packets["id"][place[is_known]] == wanted[is_known]
        if not is_known.all():
            unknown = wanted[~is_known][0]
            raise ValueError(f"`{self.transmissions}` has packet {unknown}, which nobody sent")
        size = np.where(frames["fate"] == _SENT, packets["size"][place], 0).astype(np.int64)
        found = {
            name: float(size[frames["kind"] == kind].sum()) / 1e3 / duration if duration else None
            for name, kind in KINDS.items()
        }
        shared = [value for name, value in found.items() if name != "bsm" and value is not None]
        given_up = np.count_nonzero((frames["fate"] != _SENT) & (frames["kind"] != KINDS["bsm"]))
        return {
            **{f"{name}_kbyte_s": value for name, value in found.items()},
            "sharing_kbyte_s": sum(shared) if shared else None,
            "given_up": int(given_up),
        }
