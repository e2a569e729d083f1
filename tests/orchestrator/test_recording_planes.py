"""Planes of bytes are what their definition says, compiled or not."""

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as drawn

from orchestrator.recording import planes as module
from orchestrator.recording.planes import planes, planes_in_numpy

COLUMNS = st.sampled_from(("u1", "u2", "u4", "u8")).flatmap(
    lambda code: drawn.arrays(f"<{code}", st.integers(0, 100))
)


def byte_of(number: int, place: int) -> int:
    return number >> (8 * place) & 0xFF


@given(column=COLUMNS)
def test_plane_b_has_byte_b_of_every_number(column: npt.NDArray[np.uint64]) -> None:
    numbers = column.tolist()
    expected = [[byte_of(n, b) for n in numbers] for b in range(column.itemsize)]
    for made in (planes(column), planes_in_numpy(column, are_deltas=False)):
        assert made.dtype == np.uint8
        assert made.shape == (column.itemsize, len(column))
        assert made.tolist() == expected


@given(column=COLUMNS)
def test_deltas_are_differences_to_the_number_before(column: npt.NDArray[np.uint64]) -> None:
    """Without carry: 0 - 1 is the largest number there is."""
    numbers = column.tolist()
    size = 1 << (8 * column.itemsize)
    deltas = [(n - before) % size for n, before in zip(numbers, [0, *numbers], strict=False)]
    expected = [[byte_of(n, b) for n in deltas] for b in range(column.itemsize)]
    assert planes(column, are_deltas=True).tolist() == expected
    assert planes_in_numpy(column, are_deltas=True).tolist() == expected


def test_compiled_code_makes_them_where_it_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[tuple[int, int, bool]] = []
    make = module._compiled()
    assert make is not None

    def noted(column: int, count: int, width: int, are_deltas: bool, to: int) -> None:  # noqa: FBT001  (as in C)
        made.append((count, width, are_deltas))
        make(column, count, width, are_deltas, to)

    monkeypatch.setattr(module, "_compiled", lambda: noted)
    for code in ("u1", "u2", "u4", "u8"):
        planes(np.arange(20, dtype=code), are_deltas=code == "u4")
    assert made == [(20, 2, False), (20, 4, True), (20, 8, False)]


def test_a_library_of_another_release_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    for found in (None, object()):
        monkeypatch.setattr(module, "library", lambda found=found: found)
        assert module._compiled.__wrapped__() is None
