"""Partial derivatives of the outputs of an FMU with respect to its inputs."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from typing_extensions import override

from adapters.fmi.block import shape_of
from adapters.fmi.description import FmuDescription
from adapters.fmi.errors import FmuError
from adapters.fmi.instance import FmuInstance
from adapters.fmi.variable import FmuVariable
from orchestrator.capabilities import AdjointDerivatives, DirectionalDerivatives
from orchestrator.signal import Array, Signals

_REAL: Final = frozenset({"Real", "Float64", "Float32"})


def derivatives(description: FmuDescription, instance: Callable[[], FmuInstance]) -> list[object]:
    """What the FMU knows about its derivatives, as capabilities.

    Args:
        description: of the FMU.
        instance: the running one.
    """
    jacobian = _Jacobian(description, instance)
    found: list[object] = []
    if description.has_directional:
        found.append(_Directional(jacobian))
    if description.has_adjoint:
        found.append(_Adjoint(jacobian))
    return found


class _Jacobian:
    """The continuous inputs and outputs, and what depends on what."""

    def __init__(self, description: FmuDescription, instance: Callable[[], FmuInstance]) -> None:
        self.inputs = _continuous(description.of("input"))
        unknowns = description.unknowns
        self.outputs = {
            n: v for n, v in _continuous(description.of("output")).items() if n in unknowns
        }
        self.instance = instance

    def depends(self, output: str, input_: str) -> bool:
        """Whether an output depends on an input directly."""
        known = self.outputs[output].dependencies
        return known is None or input_ in known

    def check(self, given: Signals, offered: Mapping[str, FmuVariable], what: str) -> None:
        """Refuse what has no derivative, or another shape.

        Raises:
            FmuError: and names it.
        """
        lengths = self.instance().lengths
        for name, value in given.items():
            if name not in offered:
                raise FmuError(f"`{name}` is no continuous {what}, so it has no derivatives")
            shape = shape_of(offered[name], lengths)
            if np.shape(value) != shape:
                raise FmuError(f"`{name}` has the shape {shape}, not {np.shape(value)}")

    def split(self, values: Array, names: Sequence[str], offered: Any) -> dict[str, Array]:
        """`values` of the variables `names` in order, zeros for the others of `offered`."""
        lengths = self.instance().lengths
        found = {n: np.zeros(shape_of(v, lengths)) for n, v in offered.items()}
        start = 0
        for name in names:
            size = math.prod(found[name].shape)
            found[name][...] = values[start : start + size].reshape(found[name].shape)
            start += size
        for value in found.values():
            value.flags.writeable = False
        return found


def _continuous(variables: Sequence[FmuVariable]) -> dict[str, FmuVariable]:
    return {
        v.name: v
        for v in variables
        if v.type in _REAL and v.variability == "continuous" and v.is_signal
    }


def _flat(values: Signals, names: Sequence[str]) -> Array:
    parts = [np.ravel(np.asarray(values[name], dtype=np.float64)) for name in names]
    return np.concatenate(parts) if parts else np.empty(0)


class _Directional(DirectionalDerivatives):
    """FMI 2.0.4, section 2.1.9; FMI 3.0.2, section 2.2.12.1."""

    def __init__(self, jacobian: _Jacobian) -> None:
        self._jacobian = jacobian

    @override
    def directional(self, change: Signals) -> Signals:
        jacobian = self._jacobian
        jacobian.check(change, jacobian.inputs, "input")
        knowns = [n for n in change if any(jacobian.depends(o, n) for o in jacobian.outputs)]
        unknowns = [o for o in jacobian.outputs if any(jacobian.depends(o, n) for n in knowns)]
        values = np.empty(0)
        if unknowns:
            values = jacobian.instance().directional(unknowns, knowns, _flat(change, knowns))
        return jacobian.split(values, unknowns, jacobian.outputs)


class _Adjoint(AdjointDerivatives):
    """FMI 3.0.2, section 2.2.12.2."""

    def __init__(self, jacobian: _Jacobian) -> None:
        self._jacobian = jacobian

    @override
    def adjoint(self, weight: Signals) -> Signals:
        jacobian = self._jacobian
        jacobian.check(weight, jacobian.outputs, "output")
        unknowns = [o for o in weight if any(jacobian.depends(o, n) for n in jacobian.inputs)]
        knowns = [n for n in jacobian.inputs if any(jacobian.depends(o, n) for o in unknowns)]
        values = np.empty(0)
        if knowns:
            values = jacobian.instance().adjoint(unknowns, knowns, _flat(weight, unknowns))
        return jacobian.split(values, knowns, jacobian.inputs)
