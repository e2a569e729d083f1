"""Copies of files that name outputs, so that SUMO opens the same scene and writes nothing."""

import codecs
import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final
from xml.sax.saxutils import quoteattr

from adapters.sumo.checks.reading import opened
from adapters.sumo.files import NamedFile, SceneFiles

_NOWHERE: Final = "NUL"
"""SUMO's name of an output that is dropped, on every system."""

_LINE_END: Final = re.compile(r"\r\n|\r|\n")
_QUOTED: Final = r"\"[^\"]*\"|'[^']*'"


class StandIns:
    """Files that stand in for those of a scene that name outputs.

    A file that names others is copied; in the copy it names their stand-ins by absolute paths, and
    no outputs. Lines stay where they are. All other files are read where they lie.

    Args:
        files: of the scene.
        folder: an empty one, for the copies.
    """

    def __init__(self, files: SceneFiles, folder: Path) -> None:
        self._files = files
        self._folder = folder
        self._copies: dict[Path, Path] = {}

    @property
    def originals(self) -> Mapping[str, Path]:
        """Which file each copy stands in for."""
        return MappingProxyType({str(copy): path for path, copy in self._copies.items()})

    def options(self) -> list[str]:
        """What SUMO is started with."""
        options = ["--configuration-file", str(self._files.config)]
        by_option: dict[str, list[str]] = {}
        for each in self._named_in(self._files.config):
            value = _NOWHERE if each.kind is None else str(self._of(each.path))
            by_option.setdefault(each.named_by, []).append(value)
        for option, values in by_option.items():
            options += [f"--{option}", ",".join(values)]
        for switch in ("no-step-log", "duration-log.disable"):
            options += [f"--{switch}", "true"]
        return [*options, "--remote-port", "0"]

    def _named_in(self, path: Path) -> list[NamedFile]:
        named = (*self._files.inputs, *self._files.outputs)
        return [each for each in named if each.where.file == str(path)]

    def _of(self, path: Path) -> Path:
        """What SUMO reads instead of a file."""
        named = self._named_in(path)
        if not named or not path.is_file():
            return path
        if path not in self._copies:
            copy = self._folder / f"{len(self._copies)}-{path.name.removesuffix('.gz')}"
            self._copies[path] = copy
            with opened(path) as stream:
                raw = stream.read()
            encoding = _encoding(raw)
            text = self._renamed(raw.decode(encoding), named)
            copy.write_bytes(text.encode(encoding))
        return self._copies[path]

    def _renamed(self, text: str, named: list[NamedFile]) -> str:
        """The text of a file with other names in the attributes that name files."""
        starts = [0, *(match.end() for match in _LINE_END.finditer(text))]
        parts, done = [], 0
        for each in sorted(named, key=lambda n: n.where):
            attribute = each.named_by.split()[1]
            value = _NOWHERE if each.kind is None else str(self._of(each.path))
            begin = starts[each.where.line - 1] + each.where.column - 1
            match = re.compile(rf"\s{attribute}\s*=\s*({_QUOTED})").search(text, begin)
            assert match is not None  # noqa: S101 - the parser has just seen it there
            parts += [text[done : match.start(1)], quoteattr(value)]
            done = match.end(1)
        return "".join([*parts, text[done:]])


def _encoding(raw: bytes) -> str:
    """An encoding that keeps every byte, with the columns that expat counts."""
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"
