"""Lengths of named axes: structural parameters that follow the inputs."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import Any

from adapters.fmi.block import shape_of
from adapters.fmi.connectors import start_value
from adapters.fmi.description import FmuDescription
from adapters.fmi.errors import FmuError
from adapters.fmi.variable import FmuVariable
from orchestrator.signal import Array, Signal, Signals


class Sizes:
    """The structural parameters of one FMU, and how inputs determine them.

    A tunable structural parameter that is the length of an input, and of no parameter, follows
    that input; every other one is a parameter of the component and keeps its value over the run.

    Attributes:
        start: the values before the first inputs arrive; those of `chosen` stay.
        chosen: names of the structural parameters that a scenario chooses.
        settled: those of them that could follow an input, but are the length of a parameter, too;
            connectors have numbers for these axes.
    """

    def __init__(self, description: FmuDescription, values: Mapping[str, Any]) -> None:
        structural = {v.name: v for v in description.of("structuralParameter") if v.start}
        self._arrays = {
            v.name: v
            for v in description.of("input")
            if v.is_signal and any(axis.structural for axis in v.axes)
        }
        self._users = _users(self._arrays.values())
        sizing = {axis.structural for v in description.of("parameter") for axis in v.axes}
        tunable = {n for n, v in structural.items() if v.variability == "tunable"}
        following = {n for n in self._users if n in tunable} - sizing
        self.settled = frozenset(tunable & sizing)
        self.chosen = frozenset(structural) - following
        self._bounds = {name: structural[name] for name in following}
        self.start = {
            name: _first_length(v) if name in following else int(values.get(name, v.start[0]))
            for name, v in structural.items()
        }

    @property
    def may_change(self) -> bool:
        """Whether any size follows an input."""
        return bool(self._bounds)

    def may_have_changed(self, inputs: Signals, known: Signals) -> bool:
        """Whether an input with named axes has another shape than in `known`."""
        for name in self._arrays:
            new, old = inputs[name], known.get(name, b"")
            if new is old:
                continue
            if isinstance(new, bytes) or isinstance(old, bytes) or new.shape != old.shape:
                return True
        return False

    def measure(self, inputs: Signals) -> dict[str, int]:
        """The values of the structural parameters that fit `inputs`.

        Raises:
            FmuError: inputs disagree, or the FMU does not take so many.
        """
        lengths = dict(self.start)
        for name, users in self._users.items():
            found = {_length(inputs[variable], axis): variable for variable, axis in users}
            if len(found) > 1:
                found.pop(0, None)  # an input that nobody drives; see `fill`
            if len(found) > 1:
                ends = " and ".join(f"{n} for `{source}`" for n, source in found.items())
                raise FmuError(f"the axis `{name.removeprefix('n_')}` has two lengths: {ends}")
            length, source = next(iter(found.items()))
            if name in self.chosen:
                self._check_chosen(name, length, source)
            else:
                self._check_bounds(name, length, source)
                lengths[name] = length
        return lengths

    def _check_chosen(self, name: str, length: int, source: str) -> None:
        if length not in {0, self.start[name]}:
            raise FmuError(
                f"`{source}` has length {length} along the axis `{name.removeprefix('n_')}`, but "
                f"the structural parameter `{name}` is fixed; set `{name}: {length}` instead of "
                f"{self.start[name]}"
            )

    def _check_bounds(self, name: str, length: int, source: str) -> None:
        low, high = self._bounds[name].minimum or 0, self._bounds[name].maximum
        if length < low or (high is not None and length > high):
            limit = "any number" if high is None else high
            raise FmuError(
                f"`{source}` has length {length} along the axis `{name.removeprefix('n_')}`; "
                f"the FMU takes {low} to {limit}"
            )

    def fill(self, name: str, value: Signal, lengths: Mapping[str, int]) -> Signal:
        """`value`, or start values of the right length for an input that nobody drives."""
        variable = self._arrays.get(name)
        if variable is None or isinstance(value, bytes):
            return value
        is_right = value.shape == shape_of(variable, lengths)
        return value if is_right else start_value(variable, lengths)

    def along(self, structural: set[str]) -> list[str]:
        """Names of the inputs with an axis sized by one of `structural`."""
        return [name for name, v in self._arrays.items() if structural & _structural_axes(v)]


def _length(value: Array | bytes, axis: int) -> int:
    return 0 if isinstance(value, bytes) else value.shape[axis]


def _first_length(variable: FmuVariable) -> int:
    """No element, if the FMU declares that it takes none."""
    return 0 if variable.minimum == 0 else int(variable.start[0])


def _structural_axes(variable: FmuVariable) -> set[str]:
    return {axis.structural for axis in variable.axes if axis.structural is not None}


def _users(arrays: Iterable[FmuVariable]) -> dict[str, list[tuple[str, int]]]:
    """The inputs and axes whose length each structural parameter is."""
    found: defaultdict[str, list[tuple[str, int]]] = defaultdict(list)
    for variable in arrays:
        for k, axis in enumerate(variable.axes):
            if axis.structural is not None:
                found[axis.structural].append((variable.name, k))
    return dict(found)
