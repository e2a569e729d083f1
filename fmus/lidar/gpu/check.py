"""The border: are the inputs a scene? The lidar FMU refuses the same in the same words."""

from collections.abc import Iterator
from typing import Final

import numpy as np
import numpy.typing as npt

from fmus.lidar.gpu.inputs import Inputs
from fmus.messages.bodies import BODY_CODES, Body
from orchestrator.signal import Array

COORDINATE_LIMIT: Final = 1e8
"""Beyond it a coordinate [m] is a mistake, and squares and differences lose precision."""
LENGTH_LIMIT: Final = 1e4
"""Largest size or height [m]."""
ANGLE_LIMIT: Final = 1e6
"""Largest heading [rad]."""
ID_LIMIT: Final = 2**31

Mask = npt.NDArray[np.bool_]


def check_inputs(inputs: Inputs) -> None:
    """Refuse what is no scene.

    Args:
        inputs: everything there is.

    Raises:
        ValueError: the first culprit, with its name and index.
    """
    for problem in (*_vehicle_problems(inputs), *_building_problems(inputs)):
        raise ValueError(problem)


def _is_coordinate(value: Array) -> Mask:
    """False for NaN."""
    return np.asarray(np.abs(value) <= COORDINATE_LIMIT)


def _is_length(value: Array) -> Mask:
    return np.asarray((value > 0) & (value <= LENGTH_LIMIT))


def _vehicle_problems(inputs: Inputs) -> Iterator[str]:
    """What is wrong with the first vehicle that is wrong."""
    numbers, position, heading = inputs.id, inputs.position, inputs.heading
    size, body = inputs.size, inputs.body
    wrong = (numbers < 0) | (numbers >= ID_LIMIT)
    wrong[1:] |= numbers[1:] <= numbers[:-1]
    wrong |= ~(_is_coordinate(position) & _is_length(size)).all(axis=1)
    wrong |= ~(np.abs(heading) <= ANGLE_LIMIT) | (body < 0) | (body >= len(Body))
    if not wrong.any():
        return
    i = int(wrong.argmax())
    number, before = int(numbers[i]), int(numbers[i - 1]) if i else -1
    if not 0 <= number < ID_LIMIT:
        yield f"vehicle.id[{i}] is {number}; ids are 0 ... {ID_LIMIT - 1}"
    if number <= before:
        yield f"vehicle.id[{i}] is {number} after {before}; ids must ascend, each once"
    for k in range(3):
        if not _is_coordinate(position[i, k]):
            yield _no_coordinate("vehicle.position", i, k, position[i, k])
        if not _is_length(size[i, k]):
            yield (
                f"vehicle.size[{i}, {k}] is {size[i, k]:g}; length, width and height must be "
                f"positive and at most {LENGTH_LIMIT:g} m"
            )
    if not np.abs(heading[i]) <= ANGLE_LIMIT:
        yield (
            f"vehicle.heading[{i}] is {heading[i]:g}; it must be finite and within "
            f"+-{ANGLE_LIMIT:g} rad"
        )
    yield f"vehicle.body[{i}] is {body[i]}; it must be one of {BODY_CODES}"


def _no_coordinate(name: str, i: int, k: int, value: float) -> str:
    return (
        f"{name}[{i}, {k}] is {value:g}; coordinates must be finite and within "
        f"+-{COORDINATE_LIMIT:g} m"
    )


def _building_problems(inputs: Inputs) -> Iterator[str]:
    """What is wrong with the first corner, then with the first ring, that is wrong."""
    vertex, index = inputs.building_vertex, inputs.building_index
    height = inputs.building_height
    buildings = len(height)
    wrong = ~_is_coordinate(vertex).all(axis=1) | (index < 0) | (index >= buildings)
    wrong[1:] |= index[1:] < index[:-1]
    if wrong.any():
        yield from _corner_problems(vertex, index, buildings, int(wrong.argmax()))
        return
    corners = np.bincount(index, minlength=buildings)
    wrong = (corners < 3) | ~_is_length(height)
    if not wrong.any():
        return
    b = int(wrong.argmax())
    if corners[b] < 3:
        yield f"building {b} has {corners[b]} corners in building.index; it needs 3 or more"
    yield (
        f"building.height[{b}] is {height[b]:g}; heights must be positive and at most "
        f"{LENGTH_LIMIT:g} m"
    )


def _corner_problems(vertex: Array, index: Array, buildings: int, i: int) -> Iterator[str]:
    for k in range(2):
        if not _is_coordinate(vertex[i, k]):
            yield _no_coordinate("building.vertex", i, k, vertex[i, k])
    if not 0 <= index[i] < buildings:
        yield (
            f"building.index[{i}] is {index[i]}; there are {buildings} buildings, counted from 0"
        )
    yield f"building.index[{i}] is {index[i]} after {index[i - 1]}; it must not descend"
