"""Connectors: what may be connected, and which values fit."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra import numpy as hnp

from orchestrator.signal import Causality, Connector

OUTPUT, INPUT = Causality.OUTPUT, Causality.INPUT


def test_every_difference_is_named() -> None:
    output = Connector(causality=OUTPUT, unit="dBm", shape=("vehicle",))
    input_ = Connector(causality=INPUT, unit="W", shape=("vehicle", 3))
    assert output.differences(input_) == [
        "shapes differ: ('vehicle',) and ('vehicle', 3)",
        "units differ: dBm and W",
    ]
    assert input_.differences(output)[:2] == [
        "the source is an input, not an output",
        "the target is an output, not an input",
    ]


@pytest.mark.parametrize(
    ("source", "target", "difference"),
    [
        ({"dtype": np.float32}, {}, "types differ: float32[] and float64[]"),
        ({"dtype": None}, {}, "types differ: binary (application/octet-stream) and float64[]"),
        ({"dtype": None, "mime_type": "a/b"}, {"dtype": None}, "contents differ: a/b and"),
        ({"shape": (2,)}, {"shape": (3,)}, "shapes differ: (2,) and (3,)"),
        ({"shape": ("a",)}, {"shape": ("b",)}, "shapes differ: ('a',) and ('b',)"),
        ({"shape": ("a.b",)}, {"shape": ("a",)}, "shapes differ: ('a.b',) and ('a',)"),
        ({"shape": ("a.b", 2)}, {"shape": ("c.b",)}, "shapes differ: ('a.b', 2) and ('c.b',)"),
    ],
)
def test_a_difference_names_both_sides(
    source: dict[str, Any], target: dict[str, Any], difference: str
) -> None:
    output, input_ = Connector(causality=OUTPUT, **source), Connector(causality=INPUT, **target)
    (found,) = output.differences(input_)
    assert found.startswith(difference)


@pytest.mark.parametrize(
    ("source", "target"),
    [("sharer", "left.sharer"), ("left.sharer", "sharer"), ("left.sharer", "right.sharer")],
)
def test_between_components_the_last_part_of_an_axis_counts(source: str, target: str) -> None:
    output = Connector(causality=OUTPUT, shape=(source, 2))
    assert output.differences(Connector(causality=INPUT, shape=(target, 2))) == []


@given(value=hnp.arrays(np.float64, hnp.array_shapes(max_dims=3, max_side=4)))
def test_an_array_fits_exactly_if_all_its_numbers_are_finite(value: Any) -> None:
    connector = Connector(causality=OUTPUT, shape=("n", *value.shape[1:]))
    assert bool(connector.violations(value)) == (not np.isfinite(value).all())


@pytest.mark.parametrize(
    ("value", "violation"),
    [
        (np.array([[1.0, np.nan]]), "is nan at index [0, 1]"),
        (np.array([[-np.inf, 1.0]]), "is -inf at index [0, 0]"),
        (np.zeros((2, 3)), "has length 3 along axis 1, declared float64[n, 2]"),
        (np.zeros(2), "is float64[2], declared float64[n, 2]"),
        (np.zeros((1, 2), np.float32), "is float32[1, 2], declared float64[n, 2]"),
        (b"", "is bytes, declared float64[n, 2]"),
    ],
)
def test_a_violation_says_what_was_found_and_what_was_declared(value: Any, violation: str) -> None:
    connector = Connector(causality=OUTPUT, shape=("n", 2))
    assert connector.violations(value) == [violation]


def test_start_values_are_read_only_and_empty_along_named_axes() -> None:
    start = Connector(causality=INPUT, shape=("n", 2)).start_value()
    assert isinstance(start, np.ndarray)
    assert start.shape == (0, 2)
    assert not start.flags.writeable
    assert Connector(causality=INPUT, dtype=None).start_value() == b""
    given_start = Connector(causality=INPUT, start=np.array(3.0)).start_value()
    assert given_start == np.array(3.0)
