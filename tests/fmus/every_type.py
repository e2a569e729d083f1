"""What test units with variables of every type share."""

from typing import Final, get_args

from fmus.native.interface import VariableType

TYPES: Final = tuple(kind for kind in get_args(VariableType) if kind != "Binary")
COLOURS: Final = ("red", "green", "blue")
MIME: Final = "application/x-test; version=1"
