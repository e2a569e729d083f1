"""Dataclasses of columns."""

from dataclasses import dataclass

import numpy as np

from fmus.messages.columns import rows_of, stacked
from orchestrator.signal import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Cars:
    number: Array
    place: Array


CARS = Cars(number=np.array([3, 5, 8]), place=np.arange(6.0).reshape(3, 2))


def test_rows_are_taken_by_index_in_any_order_and_by_mask() -> None:
    by_index = rows_of(CARS, np.array([2, 0]))
    assert by_index.number.tolist() == [8, 3]
    assert by_index.place.tolist() == [[4.0, 5.0], [0.0, 1.0]]
    assert rows_of(CARS, CARS.number < 8).number.tolist() == [3, 5]


def test_what_is_stacked_comes_apart_again() -> None:
    both = stacked(CARS, rows_of(CARS, np.array([1])))
    assert both.number.tolist() == [3, 5, 8, 5]
    assert rows_of(both, np.arange(3)).place.tolist() == CARS.place.tolist()
