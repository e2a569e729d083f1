"""What files of a run say of the machine: all of it, or not where it was (`--private`)."""

import abc
import os
import re
import sys
from collections.abc import Mapping
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from typing_extensions import override


class Wording(abc.ABC):
    """How text and documents are written down.

    Attributes:
        is_private: whether host name and absolute paths are left out.
    """

    is_private: bool

    @abc.abstractmethod
    def text(self, text: str) -> str:
        """Text for people, as it is written down."""

    @abc.abstractmethod
    def plain(self, value: Any) -> Any:
        """A document in terms of JSON, as it is written down."""


class Openly(Wording):
    """Everything is written as it is."""

    is_private = False

    @override
    def text(self, text: str) -> str:
        return text

    @override
    def plain(self, value: Any) -> Any:
        return value


class Privately(Wording):
    """No absolute path is written.

    A path in `folders`, among installed packages or in the working directory becomes one relative
    to that, one in the home `~/...`; of all others the name is left.

    Args:
        folders: of scenario and inputs; what is in the first is said from there.
    """

    is_private = True

    def __init__(self, *folders: Path) -> None:
        known = [*map(Path, filter(None, sys.path)), Path(sys.prefix), Path(sys.base_prefix)]
        known = [*folders, *sorted([*known, Path.cwd()], key=lambda each: -len(each.parts))]
        places = {f"{each.absolute()}{os.sep}": "" for each in known if len(each.parts) > 1}
        places.setdefault(f"{Path.home()}{os.sep}", f"~{os.sep}")
        self._places = places
        self._pattern = re.compile(rf"(?<![\w.~/\\-])(?:{'|'.join(map(re.escape, places))})")

    @override
    def text(self, text: str) -> str:
        return self._pattern.sub(lambda found: self._places[found[0]], text)

    @override
    def plain(self, value: Any) -> Any:
        match value:
            case str():
                return _name(self.text(value))
            case Mapping():
                made: dict[str, Any] = {}
                for key, each in value.items():
                    made[_free(made, self.plain(key))] = self.plain(each)
                return made
            case list() | tuple():
                return [self.plain(each) for each in value]
        return value


def _name(text: str) -> str:
    """The name alone, if `text` is an absolute path."""
    for kind in (PurePosixPath, PureWindowsPath):
        if "\n" not in text and kind(text).is_absolute():
            return kind(text).name
    return text


def _free(made: Mapping[str, Any], key: str) -> str:
    """`key`, or with a number if there is one: files of one name may be in several folders."""
    names = (key if n == 1 else f"{key} ({n})" for n in range(1, len(made) + 2))
    return next(name for name in names if name not in made)
