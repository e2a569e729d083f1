"""What `signals/index.json` says of the type of a signal, taken apart."""

import re
from typing import Final

_KIND: Final = re.compile(r"(?P<element>bool|u?int\d+|float\d+)\[(?P<axes>.*)\]")
_MIME: Final = re.compile(r"binary \((?P<mime>.*)\)")

_TEXTS: Final = ("application/json", "text/")
"""How MIME types begin whose contents are text."""


def declared_shape(kind: str) -> tuple[int | str, ...] | None:
    """The shape of a declared type, `float64[vehicle, 3]`; `None` if it is none of numbers."""
    match = _KIND.fullmatch(kind)
    if match is None:
        return None
    axes = [axis.strip() for axis in match["axes"].split(",") if axis.strip()]
    return tuple(int(axis) if axis.isdigit() else axis for axis in axes)


def element_type(kind: str) -> str | None:
    """The name of the type of an element, `float64`; `None` if it is no number."""
    match = _KIND.fullmatch(kind)
    return None if match is None else match["element"]


def mime_type(kind: str) -> str | None:
    """The MIME type of a signal of bytes, with its parameters; `None` of numbers and of text."""
    match = _MIME.fullmatch(kind)
    return None if match is None else match["mime"]


def is_text(kind: str) -> bool:
    """Whether values are text in UTF-8, such as JSON."""
    return kind == "text" or (mime_type(kind) or "").startswith(_TEXTS)
