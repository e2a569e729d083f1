"""Every exception raised on purpose, one family per person who can fix it."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass

from typing_extensions import override


def defects() -> tuple[type[BaseException], ...]:
    """What to catch where code of others is called, asked in `except` itself: all but Ctrl-C.

    `exit()` in a component is no end of the run; what asyncio and libraries in Rust raise is no
    `Exception`, and a fault of the component as well.
    """
    return () if isinstance(sys.exc_info()[1], KeyboardInterrupt) else (BaseException,)


def in_words(error: BaseException) -> str:
    """The type of `error` and what it says, whatever its `__str__` does: `TYPE: MESSAGE`."""
    kind = type(error).__name__
    try:
        message = str(error)
    except defects():
        return f"{kind}, which cannot say what is wrong: its `__str__` fails"
    return f"{kind}: {message}" if message else kind


class CosimError(Exception):
    """Base class of every error raised on purpose by this package."""


@dataclass(frozen=True, slots=True, order=True)
class Location:
    """A place in a file; lines and columns count from 1."""

    file: str
    line: int
    column: int

    @override
    def __str__(self) -> str:
        return f"{_on_one_line(self.file)}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong in a file, and where."""

    where: Location
    what: str

    @override
    def __str__(self) -> str:
        return f"{self.where}: {_on_one_line(self.what)}"


def _on_one_line(text: str) -> str:
    """Put it on one line, as scripts read problems, whatever a file or a setting has in it."""
    return "\\n".join(text.splitlines())


@dataclass(frozen=True, slots=True)
class ParameterProblem:
    """Something wrong with parameters that a plug-in checks itself, or with what they stand for.

    Attributes:
        address: of what is wrong, from the top of the parameters: keys, and indices of list
            items; empty for the whole.
        what: a sentence.
        at_key: whether the key is wrong rather than its value.
    """

    address: tuple[str | int, ...]
    what: str
    at_key: bool = False


class ScenarioError(CosimError):
    """The scenario file is wrong. Its author can fix it. Exit code 2."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        super().__init__("\n".join(map(str, problems)))
        self.problems = tuple(problems)


class SystemStructureError(CosimError):
    """Components or connections do not fit together. Exit code 2.

    Attributes:
        problems: one sentence per problem, both ends of a connection named.
    """

    def __init__(self, problems: Sequence[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = tuple(problems)


class ComponentTypeError(CosimError):
    """A component type cannot be found, loaded or given these parameters. Exit code 2.

    If several things are wrong, each is a line of the message.
    """


class ParameterError(ComponentTypeError):
    """A component type refuses parameters, or several that do not fit together. Exit code 2.

    Attributes:
        problems: each at its address.
    """

    def __init__(self, problems: Sequence[ParameterProblem]) -> None:
        super().__init__(
            "\n".join(f"`{'.'.join(map(str, each.address))}`: {each.what}" for each in problems)
        )
        self.problems = tuple(problems)


class ComponentError(CosimError):
    """A component failed or broke its contract during a run. Exit code 3.

    Components raise it (or anything else) without knowing their own name or the time; the
    simulation loop adds both.

    Attributes:
        where: the line of the component's code that raised something else, `FILE:LINE, in
            FUNCTION`; empty if there is none.
    """

    def __init__(self, component: str, time: int | None, message: str, where: str = "") -> None:
        when = "" if time is None else f" at t = {time / 1e9:.9g} s"
        super().__init__(f"component `{component}`{when}: {message}")
        self.component = component
        self.time = time
        self.message = message
        self.where = where


class PluginError(CosimError):
    """A measure, a report or a command of an installed package failed. Exit code 3.

    Attributes:
        where: the line that raised, `FILE:LINE, in FUNCTION`; empty if it is not known.
    """

    def __init__(self, message: str, where: str = "") -> None:
        super().__init__(message)
        self.where = where
