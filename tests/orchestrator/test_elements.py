"""Elements that connections name: as NumPy has them, and checked before."""

import re

import numpy as np
import pytest
from hypothesis import given, strategies as st

from orchestrator.elements import Elements, Span, named

SHAPES = st.lists(st.integers(1, 4), min_size=1, max_size=3).map(tuple)
ENDS = st.none() | st.integers(-5, 5)
PARTS = st.integers(-5, 5) | st.builds(Span, ENDS, ENDS, st.sampled_from([None, 1, 2, -1, -2]))


@given(shape=SHAPES, parts=st.lists(PARTS, min_size=1, max_size=3))
def test_elements_are_those_of_numpy_or_refused(
    shape: tuple[int, ...], parts: list[int | Span]
) -> None:
    elements = Elements(tuple(parts))
    array = np.arange(int(np.prod(shape))).reshape(shape)
    try:
        found = elements.of(shape)
    except ValueError:
        try:
            size = array[elements.index()].size
        except IndexError:
            return
        is_beyond = any(
            end is not None and not -n <= end <= n
            for part, n in zip(parts, shape, strict=False)
            if isinstance(part, Span)
            for end in (part.start, part.stop)
        )
        assert size == 0 or is_beyond
        return
    assert array[elements.index()].shape == found
    assert elements.places(shape).tolist() == array[elements.index()].tolist()


@given(parts=st.lists(PARTS, min_size=1, max_size=3))
def test_elements_are_read_as_they_are_written(parts: list[int | Span]) -> None:
    elements = Elements(tuple(parts))
    assert Elements.split(f"a.x{elements}") == ("a.x", elements)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("x[a]", "`x[a]`: `a` is no index; write `[2]`, `[1, 0]` or `[0:3]`, counted from 0"),
        ("x[]", "`x[]`: an index is missing; write"),
        ("x[1,]", "`x[1,]`: an index is missing; write"),
        ("x[1.5]", "`x[1.5]`: `1.5` is no index; write"),
    ],
)
def test_what_is_no_element_is_said(text: str, problem: str) -> None:
    with pytest.raises(ValueError, match="index") as error:
        Elements.split(text)
    assert str(error.value).startswith(problem)


@pytest.mark.parametrize(
    ("text", "shape", "problem"),
    [
        ("x[3]", (3,), "`[3]`: axis 0 has the indices 0 to 2"),
        ("x[-4]", (3,), "`[-4]`: axis 0 has the indices 0 to 2"),
        ("x[0, 2]", (3, 2), "`[0, 2]`: axis 1 has the indices 0 to 1"),
        ("x[0:4]", (3,), "`[0:4]`: axis 0 has the length 3"),
        ("x[2:2]", (3,), "`[2:2]`: there are no elements in this range"),
        ("x[::0]", (3,), "`[::0]`: a step of 0 leads nowhere"),
        ("x[0]", (), "`[0]` says 1, and it has no axes"),
        ("x[0, 0]", (3,), "`[0, 0]` says 2, and it has 1 axis"),
        ("x[0]", ("vehicle", 3), "`[0]`: the length of its axis `vehicle` may change; write `:`"),
    ],
)
def test_elements_that_are_not_there_are_said(
    text: str, shape: tuple[int | str, ...], problem: str
) -> None:
    split = Elements.split(text)
    assert split is not None
    with pytest.raises(ValueError, match=f"^{re.escape(problem)}"):
        split[1].of(shape)


def test_an_axis_whose_length_changes_may_be_taken_whole() -> None:
    assert Elements((Span(), 0)).of(("vehicle", 3)) == ("vehicle",)


def test_at_most_three_elements_are_named() -> None:
    assert named([0, 3, 4, 5, 6], (3, 3)) == "[0, 0], [1, 0], [1, 1] and 2 more"
