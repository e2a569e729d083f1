"""Polynomials and slopes travel to other processes bit for bit."""

import json
from typing import Any

import numpy as np
import pytest

from orchestrator.course import Course
from orchestrator.remote.block import WireError
from orchestrator.remote.courses import (
    courses_from_document,
    courses_to_document,
    slopes_from_document,
    slopes_to_document,
)

VALUES = [
    np.array(0.1),
    np.array([1.0, 2.0 / 3.0, -0.0]),
    np.array([[1.1, 2.2], [3.3, 4.4]], np.float32),
    np.zeros((0, 3)),
    np.arange(6.0).reshape(2, 3).T,
]


@pytest.mark.parametrize("value", VALUES, ids=lambda v: f"{v.dtype}{list(v.shape)}")
def test_every_bit_arrives(value: Any) -> None:
    course = Course((value, value / 3, value * 1e300 if value.dtype == np.float64 else value))
    text = json.dumps([courses_to_document({"u": course}), slopes_to_document({"y": value})])
    courses, slopes = json.loads(text)
    arrived = courses_from_document(courses)["u"]
    assert arrived.degree == 2
    for sent, got in zip(
        (*course.coefficients, value),
        (*arrived.coefficients, slopes_from_document(slopes)["y"]),
        strict=True,
    ):
        assert got.dtype == sent.dtype
        assert got.shape == sent.shape
        assert got.tobytes() == sent.tobytes()


@pytest.mark.parametrize("kind", [",", "O", "f8,f8", 3, None])
def test_an_element_type_that_is_none_is_refused(kind: object) -> None:
    """Of `,` NumPy says that it is wrong syntax."""
    with pytest.raises(WireError, match="is not an element type"):
        courses_from_document({"u": [{"type": kind, "shape": [], "data": ""}]})
