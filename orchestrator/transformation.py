"""What happens to a value between an output and an input, and whether their types allow for it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from orchestrator.elements import WHOLE, Elements
from orchestrator.operation import Operation, add, multiply, spelled
from orchestrator.signal import Causality, Connector, along
from orchestrator.timebase import Duration, StepSize, format_duration
from orchestrator.unit_conversion import UnitsDifferError, conversion

_EXACT_BITS: Final = {"f2": 11, "f4": 24, "f8": 53}
"""Whole numbers of so many bits are exact in these element types."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Transformation:
    """What a connection does with the values that it carries.

    Attributes:
        picked: the elements of the output that are read.
        placed: the elements of the input that are driven.
        gain, offset: `gain * value + offset`, with `value` and `offset` in the unit of the input.
        delay: how old a value is at least when it is read [ns].
        sample: values are read at multiples of this since the start of the run, and held in
            between [ns]; 0 stands for whenever the target reads.
        adds: whether the value is added to that of the connection before it to the same elements.
        converts: whether the unit of the output is converted to that of the input; if not, the
            number is taken as it is, whatever the units.
    """

    picked: Elements = WHOLE
    placed: Elements = WHOLE
    gain: float = 1.0
    offset: float = 0.0
    delay: Duration = 0
    sample: StepSize = 0
    adds: bool = False
    converts: bool = True

    @property
    def arithmetic(self) -> tuple[Operation, ...]:
        """Gain and offset, as far as they change anything."""
        return (
            *([multiply(self.gain)] if self.gain != 1.0 else []),
            *([add(self.offset)] if self.offset else []),
        )

    def operations(self, output: Connector, input_: Connector) -> tuple[Operation, ...]:
        """From values of an output to what an input sees.

        Raises:
            UnitsDifferError: the units of both cannot be converted.
        """
        units = conversion(output, input_) if self.converts else ()
        return (*units, *self.arithmetic)


PLAIN: Final = Transformation()
"""The value arrives as it is."""


@dataclass(frozen=True, slots=True)
class Term:
    """One output as it enters an input.

    Attributes:
        component, output: where it comes from.
        picked: the elements that are read.
        operations: from what is read to what the input sees.
        delay, sample: as in `Transformation` [ns].
    """

    component: str
    output: str
    picked: Elements
    operations: tuple[Operation, ...]
    delay: Duration
    sample: StepSize


@dataclass(frozen=True, slots=True)
class Part:
    """Elements of an input, and the outputs whose sum they are."""

    placed: Elements
    terms: tuple[Term, ...]


@dataclass(frozen=True, slots=True)
class Mix:
    """How one input is made of outputs.

    Attributes:
        input: its name.
        dtype: its element type.
        parts: which do not overlap; other elements keep the start value.
    """

    input: str
    dtype: "np.dtype[Any] | None"
    parts: tuple[Part, ...]

    @property
    def components(self) -> frozenset[str]:
        """Whose outputs it reads."""
        return frozenset(term.component for term in self.terms)

    @property
    def terms(self) -> tuple[Term, ...]:
        """All of its terms, part by part."""
        return tuple(term for part in self.parts for term in part.terms)


def term(
    component: str, output: str, ends: tuple[Connector, Connector], way: Transformation
) -> Term:
    """The output `component.output` as it enters an input.

    Args:
        component: its name.
        output: its name.
        ends: the output and the input, between which `problems` finds nothing.
        way: from one to the other.
    """
    operations = way.operations(*ends)
    return Term(component, output, way.picked, operations, way.delay, way.sample)


def is_plain(output: Connector, input_: Connector, way: Transformation) -> bool:
    """Whether the values arrive as they are."""
    return (
        way == PLAIN and not output.differences(input_) and not spelled(conversion(output, input_))
    )


def problems(
    output: Connector, input_: Connector, way: Transformation, step: StepSize
) -> list[str]:
    """Why the output may not drive the input in this way; empty if it may.

    Args:
        output: at one end.
        input_: at the other end.
        way: from one to the other.
        step: the communication step size of the component that reads [ns].
    """
    if output.causality is not Causality.OUTPUT or input_.causality is not Causality.INPUT:
        return output.differences(input_)
    if output.is_binary or input_.is_binary:
        is_changed = replace(way, delay=0, sample=0) != PLAIN
        binary = "a Binary has no elements and no gain, offset or sum"
        found = output.differences(input_) + ([binary] if is_changed else [])
        return [*found, *_timing_problems(output, way, step)]
    return [
        *_shape_problems(output, input_, way),
        *_type_problems(output, input_, way),
        *_timing_problems(output, way, step),
    ]


def described(output: Connector, input_: Connector, way: Transformation) -> str:
    """What happens on the way, as text: `* 5 / 18, 20 ms later`; empty if nothing does."""
    is_wider = not output.is_binary and np.dtype(output.dtype) != np.dtype(input_.dtype)
    operations = () if output.is_binary else way.operations(output, input_)
    is_kept = not way.converts and output.unit != input_.unit
    said = [
        *(["added"] if way.adds else []),
        *([spelled(operations)] if operations else []),
        *(["unit not converted"] if is_kept else []),
        *([f"as {np.dtype(input_.dtype)}"] if is_wider else []),
        *([f"{format_duration(way.delay)} later"] if way.delay else []),
        *([f"sampled every {format_duration(way.sample)}"] if way.sample else []),
    ]
    return ", ".join(said)


def is_widening(source: "np.dtype[Any]", target: "np.dtype[Any]") -> bool:
    """Whether every value of one element type is one of the other, too; Booleans are no numbers."""
    if source == target:
        return True
    if "b" in {source.kind, target.kind}:
        return False
    if target.kind == "f" and source.kind in "iu":
        return np.iinfo(source).bits <= _EXACT_BITS[target.str[1:]]
    return bool(np.can_cast(source, target, "safe"))


def _shape_problems(output: Connector, input_: Connector, way: Transformation) -> Iterator[str]:
    shapes = []
    if not way.placed.are_all and not _is_fixed(input_):
        yield f"elements of the target: `{way.placed}`: its length may change; drive all of it"
        return
    for connector, elements, end in (
        (output, way.picked, "source"),
        (input_, way.placed, "target"),
    ):
        try:
            shapes.append(elements.of(connector.shape))
        except ValueError as error:
            yield f"elements of the {end}: {error}"
    if len(shapes) == 2 and along(shapes[0]) != along(shapes[1]):
        yield f"shapes differ: {shapes[0]} and {shapes[1]}"


def _is_fixed(connector: Connector) -> bool:
    return all(isinstance(length, int) for length in connector.shape)


def _type_problems(output: Connector, input_: Connector, way: Transformation) -> Iterator[str]:
    source, target = np.dtype(output.dtype), np.dtype(input_.dtype)
    if not is_widening(source, target):
        yield f"types differ: {output.kind()} and {input_.kind()}"
    try:
        units = conversion(output, input_) if way.converts else ()
    except UnitsDifferError as error:
        yield f"{error}; `convert: false` would take the number as it is"
        return
    if target.kind == "f":
        return
    if units:
        what = f"which takes a floating-point input, not {target}"
        yield f"units differ: {output.unit} and {input_.unit} ({spelled(units)}, {what})"
    if way.arithmetic or way.adds:
        yield f"a gain, offset or sum takes a floating-point input, not {target}"


def _timing_problems(output: Connector, way: Transformation, step: StepSize) -> Iterator[str]:
    if not all(map(math.isfinite, (way.gain, way.offset))):
        yield "gain and offset must be finite"
    if way.sample and way.sample % step:
        yield (
            f"`sample` must be a multiple of the step size of the target, "
            f"{format_duration(step)}, got {format_duration(way.sample)}"
        )
    if output.carries_events and (way.delay or way.sample):
        yield "it carries events, which can be neither delayed nor sampled"
