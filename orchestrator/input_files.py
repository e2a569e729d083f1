"""The files that a run reads: which they are, what is wrong with them, and their digests."""

import abc
import dataclasses
import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from orchestrator.component import Component
from orchestrator.errors import ParameterProblem, Problem

Finding: TypeAlias = Problem | ParameterProblem
"""Something found in an input file, at its place there, or about the parameter that names it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FileCheck:
    """What is found in the input files of a component.

    Attributes:
        problems: what would end a run.
        remarks: what is not wrong, but may not be meant.
    """

    problems: tuple[Finding, ...] = ()
    remarks: tuple[Finding, ...] = ()


class FileReadingComponent(Component):
    """A component whose input files name further ones, or that can say what is wrong with them.

    Files that a parameter of the type `Path` names are known without this capability.
    """

    @classmethod
    @abc.abstractmethod
    def input_files(cls, parameters: Any) -> Iterable[Path]:
        """Every existing file that an instance with these parameters reads.

        Args:
            parameters: an instance of the class's `Parameters`.
        """

    @classmethod
    @abc.abstractmethod
    def check_files(cls, parameters: Any, *, thorough: bool) -> FileCheck:
        """Everything wrong with these files. It raises nothing, whatever they contain.

        Args:
            parameters: an instance of the class's `Parameters`.
            thorough: whether everything that can be found is wanted, for `nlosim check`. If not,
                the check is made before every run and takes no longer than reading the files.
        """


def named_files(value: Any) -> Iterator[Path]:
    """Every file that exists among the paths in `value`, a parameter value or a mapping of them."""
    match value:
        case Path():
            if value.is_file():
                yield value
        case Mapping():
            for item in value.values():
                yield from named_files(item)
        case tuple():
            for item in value:
                yield from named_files(item)
        case _ if dataclasses.is_dataclass(value):
            for field in dataclasses.fields(value):
                yield from named_files(getattr(value, field.name))


def digest(path: Path) -> str:
    """SHA-256 of a file, hexadecimal.

    Raises:
        OSError: it cannot be read.
    """
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
