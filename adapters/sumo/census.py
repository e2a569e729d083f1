"""Who is in SUMO after each step: everybody that SUMO reports, and nobody else."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from adapters.sumo.equipment import Outfitter
from adapters.sumo.population import Kind, Poses, Roster, Vehicle, key_of
from adapters.sumo.scene import VehicleTypes
from adapters.sumo.simulation import Sumo

logger = logging.getLogger(__name__)

_PERSON: Final = Kind.PERSON


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """What a step of SUMO changed.

    Attributes:
        entered: those who are new.
        left: keys of those who are gone.
    """

    entered: tuple[Vehicle, ...]
    left: frozenset[str]


class Census:
    """Keeps the roster of everybody on the road, parked beside it, or on foot.

    A vehicle that SUMO teleports leaves, and enters under another number where SUMO puts it down;
    an entity stays that entity, and keeps what it carries. One that takes over the name of one that
    left is another one, too. Persons who ride are no bodies of their own; they leave when they
    board and enter when they alight.

    Args:
        sumo: the simulation.
        types: of the scene.
        outfitter: says what those carry that nobody declared.

    Attributes:
        roster: who is there.
        poses: theirs.
    """

    def __init__(self, sumo: Sumo, types: VehicleTypes, outfitter: Outfitter) -> None:
        self.roster = Roster.empty()
        self.poses = Poses.nobody()
        self._sumo = sumo
        self._types = types
        self._outfitter = outfitter
        self._vehicles: Sequence[str] = ()
        self._persons: Sequence[str] = ()
        self._away: dict[str, Vehicle] = {}

    def take(self, expected: Mapping[str, Vehicle], leaving: frozenset[str]) -> Change:
        """Look who is there after a step of SUMO.

        Args:
            expected: by key, those who may have entered and are known, in the order in which they
                get their numbers; all others follow by name.
            leaving: keys of those who are on their way out, whatever SUMO says.
        """
        change = self._change(expected, leaving)
        for key in sorted(change.left):
            self._outfitter.forget(self.roster.of(key))
        self.roster = self.roster.changed(change.entered, change.left)
        self.poses = self._read()
        return change

    def _change(self, expected: Mapping[str, Vehicle], leaving: frozenset[str]) -> Change:
        vehicles, persons = self._sumo.vehicles(), self._sumo.persons()
        departed, lifted = self._sumo.departed(), self._sumo.lifted()
        same = (vehicles, persons) == (self._vehicles, self._persons)
        if same and not (departed or lifted or leaving):
            return Change(entered=(), left=frozenset())
        self._vehicles, self._persons = vehicles, persons
        there = dict.fromkeys(vehicles, Kind.VEHICLE)
        there |= {key_of(name, _PERSON): _PERSON for name in persons}
        for key in leaving:
            there.pop(key, None)
        passed = departed - there.keys() - leaving
        if passed:
            names = ", ".join(f"`{name}`" for name in sorted(passed))
            logger.info("entered and left within one step of SUMO, and is not signalled: %s", names)
        known = self.roster.keys
        successors = (departed | lifted) & known & there.keys()
        left = frozenset((known - there.keys()) | successors)
        for name in sorted(lifted & left):
            logger.info("SUMO teleports vehicle `%s`; it enters again as another one", name)
            if self.roster.of(name).role:
                self._away[name] = self.roster.of(name)
        for name in departed & self._away.keys():  # the name is another one's now
            del self._away[name]
        new = there.keys() - (known - successors)
        entered = [vehicle for key, vehicle in expected.items() if key in new]
        others = new - expected.keys()
        entered += [self._of_the_scene(key, there[key]) for key in sorted(others)]
        return Change(entered=tuple(entered), left=left)

    def _of_the_scene(self, key: str, kind: Kind) -> Vehicle:
        """Somebody whom SUMO brought in by itself, or an entity that comes back."""
        if key in self._away:
            return self._away.pop(key)
        if kind is _PERSON:
            name = key.rpartition("\0")[2]
            return self._outfitter.equip(name, self._types[self._sumo.type_of_person(name)], kind)
        return self._outfitter.equip(key, self._types[self._sumo.type_of(key)], kind)

    def _read(self) -> Poses:
        """The poses of the roster, as SUMO has them."""
        roster = self.roster
        if not roster.has_persons:
            return Poses.from_sumo(self._sumo.vehicle_poses(roster.names), roster.size[:, 0])
        poses = np.empty((len(roster.names), 4))
        readers = {Kind.VEHICLE: self._sumo.vehicle_poses, _PERSON: self._sumo.person_poses}
        for kind, (rows, names) in roster.of_kinds.items():
            poses[rows] = readers[kind](names)
        return Poses.from_sumo(poses, roster.size[:, 0])
