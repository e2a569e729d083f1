"""Who is who in the encounter."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Roles:
    """The vehicles of the encounter, `NO_VEHICLE` for one that never entered."""

    ego: int
    hidden: int
    sharing: int
