"""The check of what a component hands out, made once for every new value.

Most values pass a test of a few hundred nanoseconds; whatever does not is looked at again, at
leisure, to find out what is wrong with it.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

from orchestrator.declared import not_a_mapping
from orchestrator.signal import Causality, Connector, Signal, Signals, Variability, text_problems
from orchestrator.suggestion import suggestion

Accepts: TypeAlias = Callable[[Any], bool]

_set_flags: Any = np.ndarray.setflags
"""`setflags` with a positional `write`, which the stubs do not know: less than half as long."""


_NOTHING: Any = object()
"""What stands for a value that was not there before; `None` may be what a component hands out."""


class OutputCheck:
    """Checks the outputs of one component against its connectors.

    A value that is the same object as before is not looked at again; arrays become read-only.
    """

    __slots__ = ("_accepts", "_axes", "_connectors", "_count")

    def __init__(self, connectors: Mapping[str, Connector]) -> None:
        self._connectors = {
            name: connector
            for name, connector in connectors.items()
            if connector.causality is Causality.OUTPUT
        }
        self._accepts = [(name, _acceptance(c)) for name, c in self._connectors.items()]
        self._count = len(self._connectors)
        self._axes = _shared_axes(self._connectors)

    def problems(self, outputs: Signals, before: Signals) -> list[str]:
        """Say how `outputs` breaks the declaration of the connectors; empty if it does not.

        Args:
            outputs: what `Component.outputs` returned.
            before: the outputs that were checked before.
        """
        problems = []
        try:
            if len(outputs) != self._count:
                return [self._names(outputs)]
            for name, accepts in self._accepts:
                value = outputs[name]
                if value is not before.get(name, _NOTHING) and not accepts(value):
                    problems += self._look_again(name, value, before)
        except KeyError:
            return [self._names(outputs)]
        except TypeError:
            if wrong := not_a_mapping(outputs):
                return [wrong]
            raise
        if problems or not self._axes:
            return problems
        return self._lengths(outputs)

    def _names(self, outputs: Signals) -> str:
        missing = [f"`{name}`" for name in self._connectors if name not in outputs]
        unknown = [
            f"`{name}` ({suggestion(name, self._connectors)})"
            for name in outputs
            if name not in self._connectors
        ]
        parts = [
            *([f"does not write its output {', '.join(missing)}"] if missing else []),
            *([f"writes {', '.join(unknown)}, not an output"] if unknown else []),
        ]
        return " and ".join(parts)

    def _look_again(self, name: str, value: Signal, before: Signals) -> list[str]:
        connector = self._connectors[name]
        if not isinstance(value, np.ndarray | bytes):
            kind = type(value).__name__
            hint = (
                "; write `np.asarray(...)`" if isinstance(value, float | int | np.generic) else ""
            )
            return [f"output `{name}` is {kind}, declared {connector.kind()}{hint}"]
        if isinstance(value, np.ma.MaskedArray):  # each reader would see something else in it
            return [f"output `{name}` is a masked array; write `array.filled(...)`"]
        problems = [f"output `{name}` {text}" for text in connector.violations(value)]
        fixed = connector.variability is Variability.FIXED and name in before
        if not problems and fixed and not same(value, before[name]):
            problems = [f"output `{name}` changed, but is declared fixed"]
        if isinstance(value, np.ndarray):
            value.flags.writeable = False
        return problems

    def _lengths(self, outputs: Signals) -> list[str]:
        problems = []
        for axis, places in self._axes:
            if len({np.shape(outputs[name])[index] for name, index in places}) > 1:
                lengths = {name: np.shape(outputs[name])[index] for name, index in places}
                found = ", ".join(f"{length} in `{name}`" for name, length in lengths.items())
                problems.append(f"the outputs differ in length along axis `{axis}`: {found}")
        return problems


def same(left: Signal, right: Signal) -> bool:
    """Whether two signals are equal in type, shape and every bit."""
    if isinstance(left, bytes) or isinstance(right, bytes):
        return type(left) is type(right) and left == right
    return (
        left.dtype == right.dtype
        and left.shape == right.shape
        and left.tobytes() == right.tobytes()
    )


def _acceptance(connector: Connector) -> Accepts:
    """A quick test of a value; `False` means "look again", not "wrong"."""
    if connector.variability is Variability.FIXED or _is_bounded(connector):
        return lambda _: False
    if connector.is_text:
        return lambda value: type(value) is bytes and not text_problems(value)
    if connector.is_binary:
        return lambda value: type(value) is bytes
    if connector.shape == () and np.dtype(connector.dtype).kind == "f":
        return _finite_scalar(np.dtype(connector.dtype))
    return _array(np.dtype(connector.dtype), connector.shape)


def _is_bounded(connector: Connector) -> bool:
    """Whether the values have a declared range or order."""
    said = connector.meaning
    bounds = None if said is None else (said.minimum, said.maximum)
    return said is not None and (said.is_ascending or bounds != (None, None))


def _finite_scalar(dtype: "np.dtype[Any]") -> Accepts:
    def accepts(value: Any) -> bool:
        if type(value) is not np.ndarray or value.dtype is not dtype or value.ndim:
            return False
        _set_flags(value, False)  # noqa: FBT003
        return math.isfinite(value)

    return accepts


def _array(dtype: "np.dtype[Any]", shape: tuple[int | str, ...]) -> Accepts:
    rank = len(shape)
    fixed = [(axis, length) for axis, length in enumerate(shape) if isinstance(length, int)]
    whole = shape if len(fixed) == rank else None
    rest = [] if whole is not None else fixed
    has_nan = dtype.kind == "f"

    def accepts(value: Any) -> bool:
        if type(value) is not np.ndarray or value.dtype is not dtype:
            return False
        found = value.shape
        if len(found) != rank if whole is None else found != whole:
            return False
        for axis, length in rest:
            if found[axis] != length:
                return False
        _set_flags(value, False)  # noqa: FBT003
        # `count_nonzero` takes a third of the time of `all`
        return not has_nan or np.count_nonzero(np.isfinite(value)) == value.size

    return accepts


def _shared_axes(
    connectors: Mapping[str, Connector],
) -> list[tuple[str, list[tuple[str, int]]]]:
    """Named axes that occur more than once: the name, and (connector, index) of each place."""
    places: dict[str, list[tuple[str, int]]] = defaultdict(list)
    for name, connector in connectors.items():
        for index, axis in enumerate(connector.shape):
            if isinstance(axis, str):
                places[axis].append((name, index))
    return [(axis, where) for axis, where in places.items() if len(where) > 1]
