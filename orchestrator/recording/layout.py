"""How a recording lies on disk.

    manifest.json                           what was run, and what became of it
    signals/index.json                      the type of every recorded signal
    signals/<component>/time.zst            int64 [ns]: when each sample was published
    signals/<component>/<connector>.zst     the values of all samples
    signals/<component>/<connector>.rows.zst   int64: rows of each sample, if that varies
    signals/<component>/<connector>.shape.zst  int64: shape of each sample, if more varies
    signals/<component>/<part>+<row>.npy    what is not in <part>.zst yet, from that row on

Each is a part: an array of rows, in compressed blocks (`orchestrator.recording.blocks`). While a
run goes on, and after it was killed, the last rows of a part lie beside it, as they are.
The layout of the values follows from the declared shape; see `Layout`. A signal that is declared
fixed has one sample, at the first time. Earlier releases wrote every part as `<part>.npy`, which
is still read.
"""

import dataclasses
import enum
import errno
import glob
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from orchestrator.disk import naming
from orchestrator.errors import CosimError
from orchestrator.signal import Connector, Variability

INDEX: Final = "signals/index.json"
MANIFEST: Final = "manifest.json"

SUFFIX: Final = ".zst"
"""How the name of a file of blocks ends."""


_ROOM: Final = 2000
"""Blanks behind the first manifest of a run [byte]."""


class RecordingError(CosimError):
    """A recording cannot be written there, or does not hold what was asked for. Exit code 2."""


class Layout(enum.Enum):
    """How the samples of one signal are laid out in its file of values."""

    UNIFORM = "uniform"
    """No named axis: shape (samples, ...)."""

    RAGGED = "ragged"
    """The first axis is named: samples joined along it; rows per sample in `.rows.npy`."""

    FLAT = "flat"
    """Other axes are named: elements in C order; shape (samples, rank) in `.shape.npy`."""

    BINARY = "binary"
    """Bytes as uint8: samples joined; bytes per sample in `.rows.npy`."""

    @classmethod
    def of(cls, connector: Connector) -> "Layout":
        """The layout of the values of `connector`."""
        named = [isinstance(axis, str) for axis in connector.shape]
        if connector.is_binary:
            return cls.BINARY
        if not any(named):
            return cls.UNIFORM
        return cls.RAGGED if named[0] and not any(named[1:]) else cls.FLAT


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalType:
    """The type of a recorded signal, as `signals/index.json` has it.

    Attributes:
        layout: the value of a `Layout`.
        kind: e.g. `float64[vehicle, 3]`, as declared.
        unit: as declared.
        fixed: there is one sample only.
    """

    layout: str
    kind: str
    unit: str
    fixed: bool

    @classmethod
    def of(cls, connector: Connector) -> "SignalType":
        """The type of the values of `connector`."""
        return cls(
            layout=Layout.of(connector).value,
            kind=connector.kind(),
            unit=connector.unit,
            fixed=connector.variability is Variability.FIXED,
        )

    @classmethod
    def read(cls, path: Path, name: str, fields: Any) -> "SignalType":
        """The type of the signal `name` as the index in `path` has it.

        Raises:
            RecordingError: no recorder writes that.
        """
        names = {field.name for field in dataclasses.fields(cls)}
        if not isinstance(fields, dict) or fields.keys() != names:
            raise RecordingError(f"`{path}` is damaged: what it says of `{name}` is no type")
        if fields["layout"] not in {layout.value for layout in Layout}:
            raise RecordingError(f"`{path}` is damaged: `{name}` has a layout that does not exist")
        return cls(**fields)


@dataclass(frozen=True, slots=True)
class Files:
    """Where the parts of one signal lie in the run directory `directory`."""

    directory: Path
    component: str
    connector: str

    @property
    def folder(self) -> Path:
        """The folder of the component."""
        return self.directory / "signals" / self.component

    @property
    def times(self) -> Path:
        """When each sample of the component was published."""
        return self.folder / f"time{SUFFIX}"

    @property
    def values(self) -> Path:
        """The values of all samples."""
        return self._part("")

    @property
    def rows(self) -> Path:
        """The number of rows of each sample."""
        return self._part(".rows")

    @property
    def shapes(self) -> Path:
        """The shape of each sample."""
        return self._part(".shape")

    def _part(self, suffix: str) -> Path:
        return self.folder / f"{_stem(self.connector)}{suffix}{SUFFIX}"

    def name_of(self, part: Path) -> str:
        """What the fingerprint calls a part, wherever the run directory is."""
        return plain_of(part).relative_to(self.directory).as_posix()


def plain_of(part: Path) -> Path:
    """Where earlier releases wrote the part whose file of blocks is `part`; also its name."""
    return part.with_name(f"{part.name.removesuffix(SUFFIX)}.npy")


def tail_of(part: Path, row: int) -> Path:
    """Where the rows of `part` are that are not in a block yet, if `row` is the first of them.

    No connector has a name with `+` in it: it is percent-encoded.
    """
    return part.with_name(f"{part.name.removesuffix(SUFFIX)}+{row}.npy")


def tails_of(part: Path) -> dict[int, Path]:
    """What lies beside `part`, by the index of its first row, ascending."""
    stem = glob.escape(part.name.removesuffix(SUFFIX))
    found = {
        int(path.stem.rpartition("+")[2]): path for path in part.parent.glob(f"{stem}+[0-9]*.npy")
    }
    return dict(sorted(found.items()))


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write `content` so that a reader finds the old file or the new one, never a part."""
    _put(path, json.dumps(content, indent=2, allow_nan=False) + "\n")


def _put(path: Path, text: str) -> None:
    draft = path.with_name(f"{path.name}.draft")
    try:
        with naming(path):
            draft.write_text(text, encoding="utf-8")
            draft.replace(path)
    except OSError:
        with suppress(OSError):
            draft.unlink(missing_ok=True)
        raise


def read_json(path: Path) -> dict[str, Any]:
    """What `write_json` wrote.

    Raises:
        FileNotFoundError: there is no such file.
        RecordingError: it is damaged.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"`{path}` is damaged: {error}") from None
    if not isinstance(content, dict):
        raise RecordingError(f"`{path}` is damaged: it should be an object of JSON")
    return content


def write_manifest(directory: Path, manifest: Mapping[str, Any]) -> None:
    """Write the manifest of the run in `directory`, in one piece."""
    write_json(directory / MANIFEST, manifest)


def write_first_manifest(directory: Path, manifest: Mapping[str, Any]) -> None:
    """Write the manifest of a run that begins, with blank room for how it ends."""
    path = directory / MANIFEST
    text = json.dumps(manifest, indent=2) + "\n" + " " * _ROOM + "\n"
    try:
        _put(path, text)
    except OSError:
        with suppress(OSError):  # what there is room for will say that the run has failed
            path.write_text(text, encoding="utf-8")
        raise


def rewrite_manifest(directory: Path, manifest: Mapping[str, Any]) -> None:
    """Write how a run ended into the room that its first manifest left, on a disk that is full.

    Raises:
        OSError: there is no manifest, or not room enough.
    """
    path = directory / MANIFEST
    text = json.dumps(manifest, indent=2).encode()
    with naming(path), path.open("r+b") as file:
        missing = path.stat().st_size - len(text)
        if missing < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        file.write(text + b" " * missing)


def _stem(connector: str) -> str:
    """The name of a connector as a file name that no other connector and no part has.

    What file systems do not take is percent-encoded; so is the last letter of a name that would
    be taken for `time.zst` or for a part.
    """
    stem = quote(connector, safe="()[],")
    if stem == "time" or stem.endswith((".rows", ".shape")):
        return f"{stem[:-1]}%{ord(stem[-1]):02X}"
    return stem
