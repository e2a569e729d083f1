"""The archive of an FMU, or of a package: opened only if it can be unpacked without harm."""

import io
import lzma
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from orchestrator.errors import ComponentTypeError

MOST_FILES: Final = 200_000
"""Entries that an archive may have."""

MOST_BYTES: Final = 16 << 30
"""What an archive may unpack to [byte]."""

MOST_GROWTH: Final = 250
"""How many times its size an archive that unpacks to more than `HARMLESS_BYTES` may grow. Deflate
ends at 1032; binaries grow to two to five times their size, text and maps to ten or thirty."""

HARMLESS_BYTES: Final = 256 << 20
"""An archive may grow to this size however small it is [byte]."""

UNREADABLE: Final = (
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, EOFError, OSError,
    NotImplementedError, RuntimeError,
)  # fmt: skip
"""What comes of reading an entry that is damaged, depending on its method."""

_METHODS: Final = (
    zipfile.ZIP_STORED,
    zipfile.ZIP_DEFLATED,
    zipfile.ZIP_BZIP2,
    zipfile.ZIP_LZMA,
)
_ENCRYPTED: Final = 0x1
_BLOCK: Final = 1 << 20
"""What is compared of two files at a time [byte]."""

_QUOTED: Final = 5
"""Names in a message, at most, for each of its problems."""


@contextmanager
def opened(path: Path, kind: str = "FMU") -> Iterator[zipfile.ZipFile]:
    """The archive at `path`, for reading; nothing of it was unpacked so far.

    Args:
        path: of the file.
        kind: what it should be, for messages.

    Raises:
        ComponentTypeError: there is none, or it is refused; all reasons in one text.
    """
    if not path.is_file():
        what = "is a folder, no file" if path.is_dir() else "there is no such file"
        raise ComponentTypeError(f"{path}: {what}")
    try:
        archive = zipfile.ZipFile(path)
    except (zipfile.BadZipFile, NotImplementedError, UnicodeDecodeError) as error:
        raise ComponentTypeError(f"{path}: is no ZIP archive, so no {kind} ({error})") from error
    except OSError as error:
        raise ComponentTypeError(f"{path}: cannot be read: {error}") from error
    with archive:
        if problems := archive_problems(archive):
            raise ComponentTypeError(f"{path}: is refused: {'; '.join(problems)}")
        yield archive


def archive_problems(archive: zipfile.ZipFile) -> list[str]:
    """Everything that speaks against an archive, as far as its directory tells.

    Of its files, only those are read that have the same name and may be equal.
    """
    entries = archive.infolist()
    assert archive.fp is not None  # noqa: S101 - it is open
    sizes = _size_problems(entries, archive.fp.seek(0, io.SEEK_END))
    found = {
        "leaves the folder it is unpacked to": [e for e in entries if _leaves(e.orig_filename)],
        "is an absolute name": [e for e in entries if _is_absolute(e.orig_filename)],
        "has a character that names in an FMU cannot have": [
            e for e in entries if _is_unprintable(e.orig_filename)
        ],
        "is in it more than once, with different contents": [
            group[0] for group in _repeated(entries) if sizes or not _are_equal(archive, group)
        ],
        "is a link or a device, no file": [e for e in entries if _is_special(e)],
        "is encrypted": [e for e in entries if e.flag_bits & _ENCRYPTED],
        "is compressed by a method that is not supported": [
            e for e in entries if e.compress_type not in _METHODS
        ],
    }
    problems = [f"{_quoted(which)} {what}" for what, which in found.items() if which]
    return problems + sizes


def _leaves(name: str) -> bool:
    return ".." in name.replace("\\", "/").split("/")


def _is_absolute(name: str) -> bool:
    return name.startswith(("/", "\\")) or name[1:2] == ":"


def _is_unprintable(name: str) -> bool:
    """FMI 3.0.2, 2.5: slashes only; the rest is no name on one system or another."""
    is_drive = _is_absolute(name)
    return (
        not name
        or any(ord(character) < 32 for character in name)
        or (not is_drive and not _leaves(name) and ("\\" in name or ":" in name))
    )


def _repeated(entries: list[zipfile.ZipInfo]) -> list[list[zipfile.ZipInfo]]:
    """Groups of files that would overwrite each other."""
    groups: dict[str, list[zipfile.ZipInfo]] = {}
    for entry in entries:
        if not _is_folder(entry):
            groups.setdefault(_place(entry), []).append(entry)
    return [group for group in groups.values() if len(group) > 1]


def _are_equal(archive: zipfile.ZipFile, group: list[zipfile.ZipInfo]) -> bool:
    """Whether files have the same bytes, so that it does not matter which of them counts."""
    first, *others = group
    if any((e.file_size, e.CRC) != (first.file_size, first.CRC) for e in others):
        return False
    try:
        return all(_is_copy(archive, first, other) for other in others)
    except UNREADABLE:
        return False


def _is_copy(archive: zipfile.ZipFile, first: zipfile.ZipInfo, second: zipfile.ZipInfo) -> bool:
    with archive.open(first) as one, archive.open(second) as other:
        while (block := one.read(_BLOCK)) == other.read(_BLOCK):
            if not block:
                return True
    return False


def _is_folder(entry: zipfile.ZipInfo) -> bool:
    return entry.filename.endswith("/")  # `ZipInfo.is_dir` fails where there is no name


def _place(entry: zipfile.ZipInfo) -> str:
    return "/".join(part for part in entry.filename.split("/") if part not in {"", "."})


def _is_special(entry: zipfile.ZipInfo) -> bool:
    kind = stat.S_IFMT(entry.external_attr >> 16)
    return kind not in {0, stat.S_IFREG, stat.S_IFDIR}


def _size_problems(entries: list[zipfile.ZipInfo], packed: int) -> list[str]:
    """Sizes are those of the directory: reading an entry ends there, whatever follows."""
    problems = []
    if len(entries) > MOST_FILES:
        problems.append(f"it has {len(entries)} entries, more than {MOST_FILES}")
    unpacked = sum(entry.file_size for entry in entries)
    if unpacked > MOST_BYTES:
        problems.append(f"it unpacks to {unpacked} bytes, more than {MOST_BYTES}")
    if unpacked > HARMLESS_BYTES and unpacked > MOST_GROWTH * packed:
        problems.append(
            f"it unpacks to {unpacked} bytes, more than {MOST_GROWTH} times its own {packed}"
        )
    return problems


def _quoted(entries: list[zipfile.ZipInfo]) -> str:
    names = ", ".join(f"`{_shown(entry.orig_filename)}`" for entry in entries[:_QUOTED])
    rest = len(entries) - _QUOTED
    return names if rest <= 0 else f"{names} (and {rest} more)"


def _shown(name: str) -> str:
    """The name as it can be printed, not longer than a line."""
    text = name.encode("unicode_escape").decode() if not name.isprintable() else name
    return text if len(text) <= 100 else f"{text[:97]}..."
