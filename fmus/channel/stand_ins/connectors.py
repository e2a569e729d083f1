"""The connectors of the channel, except `probe.*`; a test compares them with the channel FMU's."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from fmus.messages.records import PACKETS_MIME, RECEPTIONS_MIME, TRANSMISSIONS_MIME
from orchestrator.signal import Causality, Connector

_IN: Final = Causality.INPUT
_OUT: Final = Causality.OUTPUT

CONNECTORS: Final[Mapping[str, Connector]] = {
    "vehicle.id": Connector(causality=_IN, dtype=np.int64, shape=("vehicle",)),
    "vehicle.position": Connector(causality=_IN, shape=("vehicle", 3), unit="m"),
    "vehicle.heading": Connector(causality=_IN, shape=("vehicle",), unit="rad"),
    "vehicle.size": Connector(causality=_IN, shape=("vehicle", 3), unit="m"),
    "vehicle.antenna_height": Connector(causality=_IN, shape=("vehicle",), unit="m"),
    "vehicle.equipped": Connector(causality=_IN, dtype=np.bool_, shape=("vehicle",)),
    "building.vertex": Connector(
        causality=_IN, shape=("building_vertex", 2), unit="m", description="taken, not used"
    ),
    "building.index": Connector(
        causality=_IN, dtype=np.int32, shape=("building_vertex",), description="taken, not used"
    ),
    "building.height": Connector(
        causality=_IN, shape=("building",), unit="m", description="taken, not used"
    ),
    "packets": Connector(
        causality=_IN,
        dtype=None,
        mime_type=PACKETS_MIME,
        description="packets to be sent; one that is held over several steps is sent once",
    ),
    "receptions": Connector(
        causality=_OUT,
        dtype=None,
        mime_type=RECEPTIONS_MIME,
        description="frames that ended at their receivers in the last step",
    ),
    "transmissions": Connector(
        causality=_OUT,
        dtype=None,
        mime_type=TRANSMISSIONS_MIME,
        description="frames that went on air, or were given up, in the last step",
    ),
    "busy_ratio": Connector(
        causality=_OUT,
        shape=("vehicle",),
        description="share of the last complete window in which each radio heard or sent a frame",
    ),
}
