"""Parameters of `FcdReplay`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

from adapters.replay.motion import Interpolation
from adapters.replay.source import Convention, Heading, Reference
from adapters.replay.tracks import Equipment
from orchestrator.parameters import parameter

Outside: TypeAlias = Literal["error", "empty"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayParameters:
    """Which file, how it is written, and what its road users carry."""

    file: Path = parameter(
        doc="SUMO's FCD output (*.xml), or a table (*.csv, *.parquet); XML and CSV also as *.gz"
    )

    # ---- time
    offset: float = parameter(
        0.0,
        unit="s",
        minimum=-4e9,
        maximum=4e9,
        doc="at the communication point t, the file is shown at its time t + offset",
    )
    interpolation: Interpolation = parameter(
        "linear", doc="between samples: linear, or hold the last one"
    )
    maximum_gap: float = parameter(
        2.0,
        unit="s",
        minimum=0.001,
        maximum=3600.0,
        doc="between samples of one road user; not seen for longer, it has left",
    )
    outside: Outside = parameter(
        "error", doc="before the file's first and after its last time: error, or an empty road"
    )

    # ---- how a table is written; FCD output has SUMO's conventions
    heading: Heading = parameter(
        "math-deg",
        doc="in a table: math-deg and math-rad count counter-clockwise from east, compass-deg "
        "clockwise from north",
    )
    reference: Reference = parameter(
        "centre", doc="what x and y are in a table: the centre of the body, or the front's middle"
    )

    # ---- bodies and what they carry
    types_file: Path | None = parameter(
        None, doc="SUMO file with `<vType>` elements, for types that SUMO does not have itself"
    )
    antenna_above_roof: float = parameter(
        0.05,
        unit="m",
        minimum=0.0,
        maximum=10.0,
        doc="height of antennas, where a type does not say `antenna_height`",
    )
    radio_share: float = parameter(
        1.0, minimum=0.0, maximum=1.0, doc="of the road users, those with a V2X radio"
    )
    lidar_share: float = parameter(
        0.0, minimum=0.0, maximum=1.0, doc="of the road users, those with a lidar"
    )
    equip_persons: bool = parameter(
        default=False, doc="whether bicycles and persons may have radios and lidars, too"
    )

    # ---- surroundings
    buildings: Path | None = parameter(
        None, doc="SUMO file with `<poly>` elements, of which those of type `building` are used"
    )
    building_height: float = parameter(
        10.0, unit="m", minimum=0.1, maximum=1000.0, doc="of buildings that do not say their own"
    )
    net: Path | None = parameter(
        None, doc="SUMO net (*.net.xml), whose lanes and junctions are the roads"
    )

    @property
    def convention(self) -> Convention:
        """How a table is written."""
        return Convention(heading=self.heading, reference=self.reference)

    @property
    def equipment(self) -> Equipment:
        """What road users carry."""
        return Equipment(
            radio_share=self.radio_share,
            lidar_share=self.lidar_share,
            persons=self.equip_persons,
        )
