"""The roles of the study, and which entities of a scenario play them.

The source of traffic numbers entities as they are declared (`vehicle.role`); what they are in the
study is told by their names in the scenario, which the manifest of a recording has.
"""

from collections.abc import Mapping
from types import MappingProxyType
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

_PLAYED_BY: Final = MappingProxyType(
    {"ego": EGO, "collider": COLLISION, "sharer": SHARING, "blocking": BLOCKING}
)
"""The roles by the names of entities; those called otherwise are background to the study."""

_ROADSIDE_UNIT: Final = "roadside_unit"
"""The type of entities that are roadside units, whatever they are called."""


def roles_of(manifest: Mapping[str, Any]) -> npt.NDArray[np.int32]:
    """The role that each value of `traffic.vehicle.role` stands for.

    Args:
        manifest: of a recorded run, with its resolved scenario.

    Returns:
        Roles, shape (entity + 1,); the first one, of those that are no entities, is `BACKGROUND`.
    """
    traffic = manifest["scenario"]["components"]["traffic"]
    entities: Mapping[str, Any] = traffic.get("parameters", {}).get("entities", {})
    roles = [_role(name, entity) for name, entity in entities.items()]
    return np.array([BACKGROUND, *roles], dtype=np.int32)


def _role(name: str, entity: Mapping[str, Any] | None) -> int:
    if entity is not None and entity["type"] == _ROADSIDE_UNIT:
        return ROADSIDE
    return _PLAYED_BY.get(name, BACKGROUND)
