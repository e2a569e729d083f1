"""What changes with every step of SUMO, of many objects: read in the cheapest way there is."""

import abc
import itertools
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from typing_extensions import override

from adapters.traffic.geometry import Float

_SPEED, _POSITION, _ANGLE = 0x40, 0x42, 0x43
_POSE: Final = (_POSITION, _ANGLE, _SPEED)
"""Variables of vehicles and persons that can be subscribed to (SUMO's TraCI constants)."""

_TEXTS: Final[Mapping[str, int]] = MappingProxyType(
    {"getVehicle": 0xC3, "getRedYellowGreenState": 0x20}
)
"""Getters of text, and the variables that they get."""


class Watch(abc.ABC):
    """Reads what changes with every step, of many objects of one module of SUMO."""

    @abc.abstractmethod
    def poses(self, names: Sequence[str]) -> Float:
        """Poses of vehicles or persons.

        Returns:
            Front bumper x, y [m], SUMO's angle [degrees] and speed [m/s], shape (vehicle, 4).
        """

    @abc.abstractmethod
    def texts(self, names: Sequence[str]) -> list[str]:
        """The text of each that is watched."""


class Getters(Watch):
    """Calls getters, which cost a microsecond in this process."""

    def __init__(self, module: Any, text: str | None) -> None:
        self._module = module
        self._text = None if text is None else getattr(module, text)

    @override
    def poses(self, names: Sequence[str]) -> Float:
        module, count = self._module, len(names)
        poses = np.empty((count, 4))
        places = itertools.chain.from_iterable(map(module.getPosition, names))
        poses[:, :2] = np.fromiter(places, np.float64, 2 * count).reshape(count, 2)
        poses[:, 2] = np.fromiter(map(module.getAngle, names), np.float64, count)
        poses[:, 3] = np.fromiter(map(module.getSpeed, names), np.float64, count)
        return poses

    @override
    def texts(self, names: Sequence[str]) -> list[str]:
        assert self._text is not None  # noqa: S101 - whoever watches says which
        return list(map(self._text, names))


class Subscriptions(Watch):
    """Subscribes to each object when it is first read; all values come with the step."""

    def __init__(self, module: Any, *, poses: bool, text: str | None) -> None:
        self._module = module
        self._text = None if text is None else _TEXTS[text]
        texts = () if self._text is None else (self._text,)
        self._variables = (*(_POSE if poses else ()), *texts)
        self._subscribed: set[str] = set()

    @override
    def poses(self, names: Sequence[str]) -> Float:
        values = self._values(names)
        poses = np.empty((len(names), 4))
        for row, name in enumerate(names):
            of = values[name]
            poses[row, :2] = of[_POSITION][:2]
            poses[row, 2:] = of[_ANGLE], of[_SPEED]
        return poses

    @override
    def texts(self, names: Sequence[str]) -> list[str]:
        assert self._text is not None  # noqa: S101 - whoever watches says which
        values, text = self._values(names), self._text
        return [values[name][text] for name in names]

    def _values(self, names: Sequence[str]) -> Mapping[str, Mapping[int, Any]]:
        values: Mapping[str, Mapping[int, Any]] = self._module.getAllSubscriptionResults()
        self._subscribed.intersection_update(values)  # who left has lost theirs
        new = [name for name in names if name not in self._subscribed]
        for name in new:
            self._module.subscribe(name, self._variables)
        self._subscribed.update(new)
        return self._module.getAllSubscriptionResults() if new else values
