"""What road users carry that the scenario does not declare one by one."""

from collections.abc import Mapping
from fnmatch import fnmatchcase

import numpy as np

from adapters.sumo.parameters import Equipment
from adapters.sumo.population import Kind, Vehicle
from adapters.sumo.scene import VehicleType
from adapters.traffic.bodies import is_motorised

_ANY = "*"


class Outfitter:
    """Draws what each road user carries when it enters; of several rules the last one holds.

    Args:
        rules: by name.
        rng: a stream of its own, two draws for each road user in the order in which they enter: so
            another share of radios leaves the traffic as it is, and the lidars too.
    """

    def __init__(self, rules: Mapping[str, Equipment | None], rng: np.random.Generator) -> None:
        self._rules = {name: rule for name, rule in rules.items() if rule is not None}
        self._rng = rng
        self._lidars = dict.fromkeys(self._rules, 0)
        self._owners: dict[str, str] = {}

    def equip(self, name: str, kind: VehicleType, what: Kind = Kind.VEHICLE) -> Vehicle:
        """The road user called `name` with what it carries."""
        radio = lidar = 0.0
        limit, granted = None, ""
        for called, rule in self._rules.items():
            if not _applies(rule, name, kind):
                continue
            radio = radio if rule.radio is None else rule.radio
            if rule.lidar is not None:
                lidar, limit, granted = rule.lidar, rule.lidar_limit, called
        has_radio, has_lidar = self._rng.random(2) < (radio, lidar)
        if has_lidar and limit is not None and self._lidars[granted] >= limit:
            has_lidar = False
        vehicle = Vehicle(
            name=name,
            type=kind,
            equipped=bool(has_radio),
            lidar=bool(has_lidar),
            antenna_height=kind.antenna_height,
            kind=what,
        )
        if has_lidar:
            self._lidars[granted] += 1
            self._owners[vehicle.key] = granted
        return vehicle

    def forget(self, vehicle: Vehicle) -> None:
        """A road user left: its lidar may be given to another."""
        granted = self._owners.pop(vehicle.key, None)
        if granted is not None:
            self._lidars[granted] -= 1


def _applies(rule: Equipment, name: str, kind: VehicleType) -> bool:
    """Whether a rule is for a road user; one for all types is for those with an engine."""
    if not fnmatchcase(name, rule.vehicles) or not fnmatchcase(kind.name, rule.types):
        return False
    return rule.types != _ANY or rule.vehicles != _ANY or is_motorised(kind.body)
