"""The connectors of relay policies: what the ego knows in, the choice out."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from fmus.messages.connectors import POSE_ERROR, RECEIVED_BSMS, inputs, outputs, when_undriven
from orchestrator.absence import Need, Undriven
from orchestrator.signal import Causality, Connector

INPUTS: Final[Mapping[str, Connector]] = when_undriven(
    inputs(
        "ego.id",
        "ego.position",
        "ego.heading",
        "ego.speed",
        "ego.size",
        "ego.route",
        "building.vertex",
        "building.index",
        "objects",
        "received.apms",
        *RECEIVED_BSMS,
        "received.link.transmitter",
        "received.link.receiver",
        "received.link.power",
        "received.sensor_data.count",
        "match.sharer",
        "match.trigger",
        *POSE_ERROR,
    ),
    {
        "ego": Undriven("there is no ego, for whom to choose"),
        "building": Undriven("the ego's map has no buildings", Need.IF_OFFERED),
        "objects": Undriven("the ego sees nobody who could be in the way", Need.IF_OFFERED),
        "received.apms": Undriven("the ego learns by BSMs alone where others are", Need.IF_OFFERED),
        "received.bsm": Undriven("the ego knows no neighbour, so that none can relay"),
        "received.link": Undriven("no power of a link is known", Need.IF_OFFERED),
        "received.sensor_data": Undriven(
            "the policy hears of no sensor data that arrived", Need.IF_OFFERED
        ),
        "pose_error": Undriven("the ego knows exactly where it is", Need.IF_OFFERED),
        "match": Undriven("nothing is ever to be relayed: the choice is the direct link"),
    },
)
_FEEDTHROUGH: Final = frozenset(INPUTS)


def _risk(description: str) -> Connector:
    return Connector(
        causality=Causality.OUTPUT,
        unit="dB.s/m",
        feedthrough=_FEEDTHROUGH,
        description=description,
    )


OUTPUTS: Final[Mapping[str, Connector]] = {
    **outputs("relay", feedthrough=_FEEDTHROUGH),
    "switches": Connector(
        causality=Causality.OUTPUT,
        dtype=np.int64,
        feedthrough=_FEEDTHROUGH,
        description="How often the choice changed while fusion was triggered",
    ),
    "risk.direct": _risk("NLOS risk of the direct link, 0 where the policy assesses none"),
    "risk.chosen": _risk("NLOS risk of the link chosen, over both hops of a relay"),
}
CONNECTORS: Final = {**INPUTS, **OUTPUTS}
