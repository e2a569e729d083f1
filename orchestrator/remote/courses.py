"""How signals change over a step, as JSON: polynomials and slopes, bit for bit."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from orchestrator.course import Course
from orchestrator.remote.block import element_type
from orchestrator.signal import Array, Signals


def courses_to_document(courses: Mapping[str, Course]) -> dict[str, Any]:
    """The coefficients of each course, by input."""
    return {name: [_plain(c) for c in course.coefficients] for name, course in courses.items()}


def courses_from_document(document: Mapping[str, Any]) -> dict[str, Course]:
    """What `courses_to_document` described.

    Raises:
        WireError: an element type is none.
        LookupError, TypeError, ValueError, AttributeError: the document is something else.
    """
    return {name: Course(tuple(map(_array, each))) for name, each in document.items()}


def slopes_to_document(slopes: Signals) -> dict[str, Any]:
    """The slope of each output, with its shape."""
    return {"slopes": {name: _plain(np.asarray(slope)) for name, slope in slopes.items()}}


def slopes_from_document(document: Mapping[str, Any]) -> dict[str, Array]:
    """What `slopes_to_document` described, each of its own shape.

    Raises:
        WireError, LookupError, TypeError, ValueError, AttributeError: as `courses_from_document`.
    """
    return {name: _array(each) for name, each in document["slopes"].items()}


def _plain(values: Array) -> dict[str, Any]:
    # `str` rather than the name: it states the byte order
    return {"type": values.dtype.str, "shape": list(values.shape), "data": values.tobytes().hex()}


def _array(document: Mapping[str, Any]) -> Array:
    flat = np.frombuffer(bytes.fromhex(document["data"]), element_type(document["type"]))
    return flat.reshape(document["shape"])
