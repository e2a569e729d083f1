"""What a component hands out is what it declared: the quick check agrees with the thorough one."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from orchestrator.algorithm.outputs import OutputCheck
from orchestrator.meaning import Meaning
from orchestrator.signal import Causality, Connector

OUTPUT = Causality.OUTPUT
CONNECTORS = {
    "scalar": Connector(causality=OUTPUT),
    "three": Connector(causality=OUTPUT, shape=(3,)),
    "rows": Connector(causality=OUTPUT, shape=("vehicle", 2)),
    "table": Connector(causality=OUTPUT, shape=(2, 3)),
    "whole": Connector(causality=OUTPUT, shape=(2,), dtype="int64"),
    "coarse": Connector(causality=OUTPUT, dtype="float32"),
    "share": Connector(causality=OUTPUT, shape=("n",), meaning=Meaning(minimum=0, maximum=0.5)),
    "above": Connector(causality=OUTPUT, meaning=Meaning(minimum=2)),
    "below": Connector(causality=OUTPUT, meaning=Meaning(maximum=0)),
    "order": Connector(causality=OUTPUT, shape=("n",), meaning=Meaning(is_ascending=True)),
    "named": Connector(causality=OUTPUT, meaning=Meaning(names="vehicle")),
    "data": Connector(causality=OUTPUT, dtype=None, mime_type="application/x-test"),
}


@st.composite
def values(draw: st.DrawFn) -> Any:
    """Arrays of few shapes and types, now and then with a value that is no number, or bytes."""
    if draw(st.integers(0, 9)) == 0:
        return draw(st.sampled_from([b"", b"ab", "ab", 1.0, None]))
    shape = tuple(draw(st.lists(st.integers(0, 3), max_size=3)))
    dtype = draw(st.sampled_from(["float64", "float64", "float32", "int64", "bool"]))
    value = np.ones(shape, dtype)
    if value.size and dtype.startswith("float") and draw(st.booleans()):
        spoilt = draw(st.integers(0, value.size - 1))
        value.flat[spoilt] = draw(st.sampled_from([np.nan, np.inf, -np.inf]))
    return value


@given(name=st.sampled_from(sorted(CONNECTORS)), value=values())
def test_a_value_is_accepted_if_and_only_if_it_violates_nothing(name: str, value: Any) -> None:
    connector = CONNECTORS[name]
    found = OutputCheck({name: connector}).problems({name: value}, {})
    if isinstance(value, np.ndarray | bytes):
        assert found == [f"output `{name}` {text}" for text in connector.violations(value)]
    else:
        assert len(found) == 1


@pytest.mark.parametrize("name", ["three", "rows"])
def test_a_masked_array_is_refused(name: str) -> None:
    """Its mask does not travel: here and in another process readers would see other numbers."""
    value = np.ma.masked_less(np.ones((3,) if name == "three" else (3, 2)), 2)
    found = OutputCheck({name: CONNECTORS[name]}).problems({name: value}, {})
    assert found == [f"output `{name}` is a masked array; write `array.filled(...)`"]


@pytest.mark.parametrize(
    ("name", "shape", "said"),
    [
        ("three", (2,), "length 2 along axis 0, declared float64[3]"),
        ("three", (4,), "length 4 along axis 0, declared float64[3]"),
        ("rows", (5, 3), "length 3 along axis 1, declared float64[vehicle, 2]"),
        ("table", (2, 2), "length 2 along axis 1, declared float64[2, 3]"),
        ("table", (3, 3), "length 3 along axis 0, declared float64[2, 3]"),
    ],
)
def test_a_length_that_is_declared_as_a_number_is_that_number(
    name: str, shape: tuple[int, ...], said: str
) -> None:
    found = OutputCheck({name: CONNECTORS[name]}).problems({name: np.zeros(shape)}, {})
    assert found == [f"output `{name}` has {said}"]


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("share", [0.5, 0.0], []),
        ("share", [0.5, 0.75], ["is 0.75 at index [1], above the declared 0.5"]),
        ("share", [-0.25], ["is -0.25 at index [0], below the declared 0"]),
        ("above", 1.0, ["is 1.0, below the declared 2"]),
        ("above", 2.0, []),
        ("below", 1.0, ["is 1.0, above the declared 0"]),
        ("below", 0.0, []),
        ("order", [1.0, 1.0], ["does not ascend: 1.0 is followed by 1.0"]),
        ("order", [1.0, 2.0], []),
        ("named", 7.0, []),
    ],
)
def test_what_values_mean_is_checked_when_they_are_handed_out(
    name: str, value: Any, said: list[str]
) -> None:
    found = OutputCheck({name: CONNECTORS[name]}).problems({name: np.array(value)}, {})
    assert found == [f"output `{name}` {text}" for text in said]


def test_none_is_no_value() -> None:
    """Not even before there is a value to compare with."""
    (problem,) = OutputCheck({"scalar": CONNECTORS["scalar"]}).problems({"scalar": None}, {})  # type: ignore[dict-item]
    assert problem == "output `scalar` is NoneType, declared float64[]"


def test_what_is_accepted_cannot_be_written_any_more() -> None:
    for name, connector in CONNECTORS.items():
        if connector.dtype is not None and connector.meaning is None:
            shape = tuple(4 if isinstance(length, str) else length for length in connector.shape)
            value = np.zeros(shape, connector.dtype)
            assert OutputCheck({name: connector}).problems({name: value}, {}) == []
            assert not value.flags.writeable


def test_a_value_that_was_accepted_is_not_looked_at_again() -> None:
    spoilt = np.array([1.0, np.nan, 2.0])
    check = OutputCheck({"three": CONNECTORS["three"]})
    assert len(check.problems({"three": spoilt}, {})) == 1
    assert check.problems({"three": spoilt}, {"three": spoilt}) == []
