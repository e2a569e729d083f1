"""Which filter a column of numbers gets, and how many are tried for it."""

from typing import Any

import numpy as np
import pytest

from orchestrator.recording import columns
from orchestrator.recording.columns import SHORT, TRIED, Columns, Form, Room, join

NOISE = np.random.default_rng(1).integers(0, 1 << 62, 3 * TRIED)
RAMP = np.arange(3 * TRIED) * 1_000_003
FLAT = np.full(3 * TRIED, 7)
CASES = {"flat": (FLAT, "words", 1), "ramp": (RAMP, "deltas", 1), "noise": (NOISE, "words", 3)}


def chosen(numbers: "np.ndarray[Any, Any]", compressed: list[int] | None = None) -> str:
    """The filter of one column, which comes back as it was; sizes of what was compressed."""
    content = np.ascontiguousarray(numbers).tobytes()
    size = numbers.itemsize
    with pytest.MonkeyPatch.context() as patch:
        counted = [] if compressed is None else compressed
        compress = columns.compress

        def count(stream: Any) -> bytes:
            counted.append(len(bytes(stream)))
            return compress(stream)

        patch.setattr(columns, "compress", count)
        about, streams = Columns(Form(stride=size, word=size), Room()).split(content, [])
    assert join(about, [bytes(each) for each in streams]).tobytes() == content
    (found,) = about["columns"]
    return str(found["filter"])


@pytest.mark.parametrize("name", CASES)
def test_of_a_short_column_the_first_filter_that_is_good_enough_is_taken(name: str) -> None:
    numbers, wanted, trials = CASES[name]
    compressed: list[int] = []
    assert chosen(numbers, compressed) == wanted
    assert compressed == [8 * TRIED] * trials


@pytest.mark.parametrize("more", [0, 1])
def test_of_a_long_column_all_filters_are_tried(more: int) -> None:
    compressed: list[int] = []
    assert chosen(np.arange(SHORT // 8 + more) * 1_000_003, compressed) == "deltas"
    assert len(compressed) == (3 if more else 1)


def test_the_middle_of_a_column_tells_what_it_is_like() -> None:
    third = TRIED
    for inside, wanted in [(RAMP, "deltas"), (FLAT, "words")]:
        column = np.concatenate([NOISE[:third], inside[:third], NOISE[third : 2 * third]])
        assert chosen(column) == wanted
        compressed: list[int] = []
        assert chosen(inside[: third // 2], compressed) == wanted
        assert compressed == [4 * third]


def test_of_equal_filters_the_cheapest_is_taken() -> None:
    """Nothing makes noise smaller, or one number, or none at all."""
    assert chosen(np.tile(NOISE, 8)) == "words"
    assert chosen(np.array([5])) == "words"
    assert chosen(np.zeros(0, np.int64)) == "words"


def test_bytes_have_no_planes() -> None:
    compressed: list[int] = []
    assert chosen(NOISE.astype(np.uint8), compressed) == "words"
    assert len(compressed) == 2
