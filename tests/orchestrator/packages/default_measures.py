"""Measures that are asked by default."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from typing_extensions import override

from orchestrator import Measure, Recording, parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class Travel(Measure):
    """How far the car drove."""

    by_default: ClassVar[bool] = True

    signal: str = parameter("car.vehicle.x", doc="`component.connector`")

    @override
    def signals(self) -> Sequence[str]:
        return (self.signal,)

    @override
    def compute(self, recording: Recording) -> Mapping[str, float | int | bool | str | None]:
        return {"metres": float(recording[self.signal].values[-1])}


@dataclass(frozen=True, slots=True, kw_only=True)
class Stillness(Measure):
    """Reads a signal that no car has."""

    by_default: ClassVar[bool] = True

    @override
    def signals(self) -> Sequence[str]:
        return ("car.vehicle.x", "car.vehicle.z")

    @override
    def compute(self, recording: Recording) -> Mapping[str, float | int | bool | str | None]:
        return {"metres": float(recording["car.vehicle.z"].values[-1])}
