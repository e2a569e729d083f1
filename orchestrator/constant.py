"""Constants that inputs have in place of a source: they are their start values, and stay."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from typing_extensions import override

from orchestrator.connection import Endpoint
from orchestrator.elements import WHOLE, Elements
from orchestrator.signal import Array, Causality, Connector, text_problems
from orchestrator.suggestion import suggestion
from orchestrator.units import NoUnitError, UnitError, number_in


class ItemError(ValueError):
    """A text is no item of an Enumeration."""


@dataclass(frozen=True, slots=True)
class Constant:
    """A value for an input, or for elements of it.

    Attributes:
        target: the input.
        value: a number, a truth value, text such as `30 km/h`, or lists of them, row by row; a
            single one is for all elements. For an input of text, that text.
        placed: the elements.
    """

    target: Endpoint
    value: Any
    placed: Elements = WHOLE

    @override
    def __str__(self) -> str:
        return f"`{self.target}{self.placed}` to {shown(self.value)}"


def shown(value: Any) -> str:
    """A constant as text, shortened."""
    text = str(value).lower() if isinstance(value, bool) else str(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def with_constant(input_: Connector, constant: Constant) -> Connector:
    """The input with the constant in its start value.

    Raises:
        ValueError: it is no input that can have it; the end of a sentence.
    """
    if input_.causality is not Causality.INPUT:
        raise ValueError("it is an output, not an input")
    if input_.is_text:
        return replace(input_, start=_text(constant))
    if input_.is_binary:
        raise ValueError("a Binary has no constant")
    if not all(isinstance(length, int) for length in input_.shape):
        raise ValueError("its length may change, so that it needs a source")
    shape = tuple(int(n) for n in constant.placed.of(input_.shape))
    value = _array(input_, constant.value)
    if value.shape not in {(), shape}:
        raise ValueError(f"it has the shape {shape}, the value {value.shape}")
    if input_.meaning is not None and (wrong := input_.meaning.violations(value)):
        raise ValueError(f"the value {'; it '.join(wrong)}")
    start = np.array(input_.start_value())
    start[constant.placed.index()] = value
    return replace(input_, start=start)


def _text(constant: Constant) -> bytes:
    if not isinstance(constant.value, str) or constant.placed != WHOLE:
        raise ValueError("expected a text, as it is text; write quotes around it")
    value = constant.value.encode()
    if problems := text_problems(value):
        raise ValueError(problems[0])
    return value


def _array(input_: Connector, value: Any) -> Array:
    """The value in the type and the unit of an input."""
    dtype = np.dtype(input_.dtype)
    try:
        found = np.array(_numbers(input_, value))
    except ValueError as error:
        if isinstance(error, UnitError | ItemError):
            raise
        raise ValueError("the lists in it differ in length") from None
    kinds = {"b": "b", "i": "iu", "u": "iu", "f": "iuf"}
    if found.dtype.kind not in kinds[dtype.kind]:
        words = {"b": "`true` or `false`", "i": "a whole number", "u": "a whole number"}
        raise ValueError(f"expected {words.get(dtype.kind, 'a number')}, as it is {dtype}")
    with np.errstate(over="ignore"):
        converted: Array = found.astype(dtype)
    is_kept = np.isfinite(converted).all() if dtype.kind == "f" else (converted == found).all()
    if not is_kept:
        raise ValueError(f"it is out of the range of {dtype}")
    return converted


def _numbers(input_: Connector, value: Any) -> Any:
    if isinstance(value, list | tuple):
        return [_numbers(input_, each) for each in value]
    if not isinstance(value, str):
        return value
    items = {} if input_.meaning is None else dict(input_.meaning.items)
    if items:
        if value not in items:
            raise ItemError(f"there is no item `{value}`; {suggestion(value, items)}")
        return items[value]
    unit, definition = input_.unit, input_.definition
    try:
        return float(number_in(value, unit, definition, is_difference=input_.is_relative))
    except NoUnitError as error:
        raise UnitError(f"`{value}` {error}") from None
