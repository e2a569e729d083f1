"""A bar that shows how far the comparison is."""

import abc
import sys
from types import TracebackType
from typing import NoReturn, Self, TextIO

from tqdm import tqdm
from typing_extensions import override


class Progress(abc.ABC):
    """Told how far the work is. Use it in a `with` statement."""

    def __enter__(self) -> Self:
        return self

    @abc.abstractmethod
    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """The work is over."""

    @abc.abstractmethod
    def begin(self, name: str) -> None:
        """The golden file `name` is next."""

    @abc.abstractmethod
    def advance(self) -> None:
        """One unit of work is done."""


class NoBar(Progress):
    """Shows nothing."""

    @override
    def __exit__(self, *_: object) -> None:
        pass

    @override
    def begin(self, name: str) -> None:
        pass

    @override
    def advance(self) -> None:
        pass


class Bar(Progress):
    """Draws a bar.

    Args:
        total: units of work.
        stream: where to draw.
    """

    def __init__(self, total: int, stream: TextIO) -> None:
        self._bar: tqdm[NoReturn] = tqdm(total=total, file=stream, leave=False)

    @override
    def __exit__(self, *_: object) -> None:
        self._bar.close()

    @override
    def begin(self, name: str) -> None:
        self._bar.set_description(name)

    @override
    def advance(self) -> None:
        self._bar.update()


def progress(total: int) -> Progress:
    """A bar on standard error if that is a terminal."""
    return Bar(total, sys.stderr) if sys.stderr.isatty() else NoBar()
