"""What is in an archive of SSP, and what the references in it name."""

import io
import posixpath
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from urllib.parse import unquote, urlsplit

from adapters.fmi.archive import UNREADABLE, archive_problems, opened
from orchestrator.errors import ComponentTypeError, Location, Problem, ScenarioError

MAIN: Final = "SystemStructure.ssd"
"""The variant of a package that counts unless another one is chosen."""

_LARGEST: Final = 64 << 20
"""What a file of XML may have [byte]."""

_LARGEST_INNER: Final = 1 << 30
"""What a package within a package may have [byte]."""


@dataclass(frozen=True, slots=True)
class Package:
    """An archive of SSP, or one within another one.

    Attributes:
        name: `car.ssp`; of an inner one `car.ssp/resources/wheel.ssp`.
        archive: for reading.
        inner: where it is in the outermost one; empty for that.
    """

    name: str
    archive: zipfile.ZipFile
    inner: tuple[str, ...] = ()

    def variants(self) -> list[str]:
        """The descriptions at the top, the main one first."""
        found = sorted(n for n in self.archive.namelist() if n.endswith(".ssd") and "/" not in n)
        return sorted(found, key=lambda name: name != MAIN)

    def has(self, name: str) -> bool:
        """Whether there is such a file."""
        return name in self.archive.namelist()

    def xml(self, name: str) -> bytes:
        """A file of XML.

        Raises:
            ScenarioError: it is damaged, or too large.
        """
        return self._bytes(name, _LARGEST)

    def within(self, name: str) -> "Package":
        """The package at `name` in this one.

        Raises:
            ScenarioError: it is damaged, or refused.
        """
        data = self._bytes(name, _LARGEST_INNER)
        where = Location(f"{self.name}/{name}", 1, 1)
        try:
            archive = zipfile.ZipFile(io.BytesIO(data))
        except (zipfile.BadZipFile, NotImplementedError, UnicodeDecodeError) as error:
            raise ScenarioError([Problem(where, f"is no ZIP archive: {error}")]) from error
        if problems := archive_problems(archive):
            raise ScenarioError([Problem(where, f"is refused: {each}") for each in problems])
        return Package(f"{self.name}/{name}", archive, (*self.inner, name))

    def _bytes(self, name: str, most: int) -> bytes:
        where = Location(f"{self.name}/{name}", 1, 1)
        if self.archive.getinfo(name).file_size > most:
            what = f"has {self.archive.getinfo(name).file_size} bytes, more than {most}"
            raise ScenarioError([Problem(where, what)])
        try:
            return self.archive.read(name)
        except UNREADABLE as error:
            raise ScenarioError([Problem(where, f"cannot be read: {error}")]) from error


@contextmanager
def opened_package(path: Path) -> Iterator[Package]:
    """The package at `path`, for reading.

    Raises:
        ScenarioError: there is none, or it is refused.
    """
    try:
        with opened(path, "SSP") as archive:
            yield Package(path.name, archive)
    except ComponentTypeError as error:
        what = str(error).removeprefix(f"{path}: ")
        raise ScenarioError([Problem(Location(str(path), 1, 1), what)]) from error


def resolved(source: str, base: str) -> tuple[str, str]:
    """The file that a reference names, and the fragment behind it.

    Args:
        source: a URI, relative to `base`; or one of the file itself, `#wheel`.
        base: the file that has the reference.

    Raises:
        ValueError: it leads out of the package.
    """
    parts = urlsplit(source)
    if parts.scheme or parts.netloc or parts.query:
        raise ValueError(f"`{source}` leads out of the package; only relative ones are read")
    if not parts.path:
        return base, unquote(parts.fragment)
    name = posixpath.normpath(posixpath.join(posixpath.dirname(base), unquote(parts.path)))
    if name.startswith(("..", "/")):
        raise ValueError(f"`{source}` leads out of the package")
    return name, unquote(parts.fragment)
