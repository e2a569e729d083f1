"""The roles of the study, and which entities of a scenario play them.

The source of traffic numbers entities as they are declared (`vehicle.role`); what they are in the
study is told by their names in the scenario, which the manifest of a recording has. Which names
those are, and what components are called, `Names` says.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

BACKGROUND: Final = 0
EGO: Final = 1
COLLISION: Final = 2
SHARING: Final = 3
BLOCKING: Final = 4
ROADSIDE: Final = 5
"""The roles."""

ROLE_WORDS: Final = (
    "background",
    "ego",
    "collision vehicle",
    "sharing node",
    "blocking vehicle",
    "roadside unit",
)
"""What they are called, by value."""

_ROADSIDE_UNIT: Final = "roadside_unit"
"""The type of entities that are roadside units, whatever they are called."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Names:
    """What a scenario calls those who play the roles, and its components.

    Attributes:
        ego: the entity that the policy drives; its signals are beneath `TRAFFIC.EGO`.
        collider: the entity that is hidden from it.
        sharer: the entity that shares its sensor data.
        blocking: the entities that hide the one from the other.
        traffic, perception, channel, facilities, relay, policy: the components.
        received: beneath which the ego vehicle's received messages are, `component.connector`.
    """

    ego: str = "ego"
    collider: str = "collider"
    sharer: str = "sharer"
    blocking: str = "blocking"
    traffic: str = "traffic"
    perception: str = "perception"
    channel: str = "channel"
    facilities: str = "facilities"
    relay: str = "relay"
    policy: str = "policy"
    received: str = "facilities.received"

    def signal(self, name: str) -> str:
        """The recorded name of the signal that the shipped scenario calls `name`."""
        for usual, own in (
            ("traffic.ego", f"{self.traffic}.{self.ego}"),
            ("facilities.received", self.received),
            ("traffic", self.traffic),
            ("perception", self.perception),
            ("channel", self.channel),
            ("facilities", self.facilities),
            ("relay", self.relay),
            ("policy", self.policy),
        ):
            if name.startswith(f"{usual}."):
                return own + name[len(usual) :]
        return name


USUAL: Final = Names()
"""The names of the shipped scenario."""


def roles_of(manifest: Mapping[str, Any], names: Names = USUAL) -> npt.NDArray[np.int32]:
    """The role that each value of `traffic.vehicle.role` stands for.

    Args:
        manifest: of a recorded run, with its resolved scenario.
        names: of the entities; those called otherwise are background to the study.

    Returns:
        Roles, shape (entity + 1,); the first one, of those that are no entities, is `BACKGROUND`.
    """
    traffic = manifest["scenario"]["components"][names.traffic]
    entities: Mapping[str, Any] = traffic.get("parameters", {}).get("entities", {})
    played = {
        names.blocking: BLOCKING,
        names.sharer: SHARING,
        names.collider: COLLISION,
        names.ego: EGO,
    }
    roles = [_role(played.get(name, BACKGROUND), entity) for name, entity in entities.items()]
    return np.array([BACKGROUND, *roles], dtype=np.int32)


def _role(played: int, entity: Mapping[str, Any] | None) -> int:
    if entity is not None and entity["type"] == _ROADSIDE_UNIT:
        return ROADSIDE
    return played
