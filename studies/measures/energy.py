"""The energy that a coupling makes or loses at its power bonds."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from typing_extensions import override

from orchestrator import Measure
from orchestrator.algorithm.extrapolation import DEGREES
from orchestrator.measure import Answer
from orchestrator.parameters import ParameterProblem, parameter
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array

_PLACES: Final = ((1 - np.sqrt(0.6)) / 2, 0.5, (1 + np.sqrt(0.6)) / 2)
_WEIGHTS: Final = (5 / 18, 8 / 18, 5 / 18)
"""The Gauss rule on [0, 1] that is exact up to degree 5."""

_NAME: Final = re.compile(r"[A-Za-z_][\w-]*")


@dataclass(frozen=True, slots=True, kw_only=True)
class Bond:
    """Two connections that carry a power together: force and velocity, voltage and current."""

    effort: str = parameter(doc="output that the component of the flow reads: a force")
    flow: str = parameter(doc="output that the component of the effort reads: a velocity")
    gain: float = parameter(
        1.0, doc="the power that the component of the flow takes in is gain x effort x flow"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class CouplingEnergy(Measure):
    """The energy that comes from nowhere, because both ends of a bond see it at different times.

    With what each component took its input to be over a step, e~ and v~, one end takes in the power
    e~ v while the other one gives e v~. The residual power is the difference of the two (Sadjina,
    Kyllingstad, Skjong and Pedersen, "Energy conservation and power bonds in co-simulations",
    Engineering with Computers 33, 2017), the residual energy its integral; above zero if energy
    was made. Inputs are as the algorithm of the run let them be; outputs are polynomials through
    what was recorded, one degree higher. Those whose members agree by iteration have no residual
    where inputs are interpolated. Derivatives of outputs that the algorithm knew are not recorded,
    and taken not to have been used.
    """

    bonds: Mapping[str, Bond] = parameter(doc="power bonds, by a name for each")

    @override
    def problems(self, components: Sequence[str]) -> Iterator[ParameterProblem]:
        for name, bond in self.bonds.items():
            ends = {_component(bond.effort), _component(bond.flow)}
            for key, end in (("effort", bond.effort), ("flow", bond.flow)):
                if _component(end) not in components:
                    what = f"`{end}` is no output: there is no component `{_component(end)}`"
                    yield ParameterProblem(("bonds", name, key), what)
            if len(ends) == 1:
                what = "effort and flow are outputs of two components that read each other"
                yield ParameterProblem(("bonds", name), what, at_key=True)
            if not _NAME.fullmatch(name):
                what = f"`{name}` is not made of letters, digits, `_` and `-`"
                yield ParameterProblem(("bonds", name), what, at_key=True)

    @override
    def signals(self) -> Sequence[str]:
        return tuple(end for bond in self.bonds.values() for end in (bond.effort, bond.flow))

    @override
    def compute(self, recording: Recording) -> Answer:
        numbers: dict[str, float | None] = {}
        tables: dict[str, Mapping[str, Array]] = {}
        for name, bond in self.bonds.items():
            times, residual, transferred = _energies(recording, bond)
            lengths = np.diff(times) / 1e9
            numbers |= {
                f"{name}_residual": float(residual.sum()),
                f"{name}_absolute": float(np.abs(residual).sum()),
                f"{name}_power": float(np.max(np.abs(residual) / lengths, initial=0.0)),
                f"{name}_transferred": float(np.abs(transferred).sum()),
            }
            tables[name] = {
                "t_ns": times[1:],
                "transferred": transferred,
                "residual": residual,
                "sum": np.cumsum(residual),
            }
        numbers["residual"] = sum(numbers[f"{name}_residual"] or 0.0 for name in self.bonds)
        return Answer(numbers=numbers, tables=tables)


@dataclass(frozen=True, slots=True)
class _Reading:
    """How one end of a bond reads the other.

    Attributes:
        degree: of the polynomial.
        is_new: whether it passes through the value at the end of the step.
    """

    degree: int
    is_new: bool


def _energies(recording: Recording, bond: Bond) -> tuple[Array, Array, Array]:
    """The energies of a bond, step by step.

    Returns:
        The communication points [ns], shape (point,); the residual energy and what the bond
        carried, shape (step,) each.
    """
    effort, flow = recording[bond.effort], recording[bond.flow]
    if not np.array_equal(effort.times, flow.times):
        raise ValueError(
            f"`{bond.effort}` and `{bond.flow}` have different communication points; the residual "
            "is that of one step of both"
        )
    e, v = (np.asarray(each.values, float).reshape(len(each), -1) for each in (effort, flow))
    if e.shape != v.shape:
        raise ValueError(f"`{bond.effort}` and `{bond.flow}` differ in shape")
    source, target = _component(bond.effort), _component(bond.flow)
    of_effort = _reading(recording.manifest, source, target)
    of_flow = _reading(recording.manifest, target, source)
    residual = np.zeros(max(len(e) - 1, 0))
    transferred = np.zeros_like(residual)
    degree = max(of_effort.degree, of_flow.degree) + 1
    h = np.diff(effort.times) / 1e9
    for place, weight in zip(_PLACES, _WEIGHTS, strict=True):
        actual = _Reading(degree, is_new=True)
        e_now, v_now = (_course(y, actual, place) for y in (e, v))
        e_seen, v_seen = _course(e, of_effort, place), _course(v, of_flow, place)
        residual += weight * h * (e_seen * v_now - e_now * v_seen).sum(axis=1)
        transferred += weight * h * (e_now * v_now).sum(axis=1)
    return effort.times, bond.gain * residual, bond.gain * transferred


def _course(values: Array, reading: _Reading, place: float) -> Array:
    """What a signal is taken to be at a share of every step.

    Args:
        values: at the communication points, shape (point, element).
        reading: which of them count.
        place: the share.

    Returns:
        Shape (step, element).
    """
    found = np.zeros((len(values) - 1, values.shape[1]))
    first = 1 if reading.is_new else 0
    for k in range(min(reading.degree + 1, len(found))):
        # the first steps have fewer values; the last round is for all that have enough
        count = min(reading.degree, k + first) + 1
        nodes = [first - j for j in range(count)]
        steps = slice(k, k + 1 if k < reading.degree else None)
        length = len(range(*steps.indices(len(found))))
        for node in nodes:
            share = np.prod([(place - m) / (node - m) for m in nodes if m != node])
            found[steps] += share * values[k + node : k + node + length]
    return found


def _reading(manifest: Mapping[str, Any], source: str, target: str) -> _Reading:
    """How a component read another one, by the algorithm of the run.

    Raises:
        ValueError: that cannot be said.
    """
    coupling = manifest["scenario"].get("coupling", {})
    turns: Sequence[str] = manifest.get("turns", ())
    match coupling.get("algorithm", "gauss-seidel"):
        case "jacobi":
            return _Reading(DEGREES[coupling.get("extrapolation", "hold")], is_new=False)
        case "gauss-seidel" if {source, target} <= set(turns):
            is_new = turns.index(source) < turns.index(target)
            return _Reading(DEGREES[coupling.get("extrapolation", "hold")], is_new=is_new)
        case "fixed-point" | "quasi-newton" if coupling.get("iterate", "cycles") == "cycles":
            return _Reading(DEGREES[coupling.get("interpolation", "hold")], is_new=True)
        case name:
            raise ValueError(
                f"the recording does not tell what inputs were between two communication points "
                f"with `{name}` as in this run"
            )


def _component(end: str) -> str:
    return end.partition(".")[0]
