"""What is known of a campaign that is under way, safe against its sudden end.

One file says what the campaign is; one that goes on must be the same. One says who began it and
went on with it, when and where. One has a line of JSON for everything that is finished, in the
order of finishing.
"""

import abc
import json
import logging
import os
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Generic, TextIO, TypeVar

from orchestrator.errors import CosimError
from orchestrator.machine import commit, cpu, memory_gib
from orchestrator.provenance import nlosim_version, provenance
from orchestrator.recording.layout import read_json, write_json
from orchestrator.wording import Wording

logger = logging.getLogger(__name__)

Entry = TypeVar("Entry")

_CHECKSUM: Final = "crc32"
"""The key of a line that says the CRC-32 of the rest, as JSON."""


class ResumeError(CosimError):
    """The directory holds nothing to go on with, or something else. Exit code 2."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """What all experiments have in common, or all trainings.

    Attributes:
        noun: what messages call one.
        identity: the name of the file that says what one is.
        sessions: the name of the file that says who began it and went on; may be the same.
        entries: the name of the file with a line for everything that is finished.
        ordered: whether a line of these means nothing without those before it.
        growing: what may be added before one goes on, for messages.
        names: what messages call the parts of its identity; the others are called by their keys.
        remarks: what is said of the former session if a fact of the new one differs, by its key.
    """

    noun: str
    identity: str
    sessions: str
    entries: str
    ordered: bool
    growing: str
    names: Mapping[str, str]
    remarks: Mapping[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Former:
    """A campaign as its directory has it.

    Attributes:
        identity: what it is.
        sessions: of every start, where its results come from.
        lines: what is finished.
    """

    identity: Mapping[str, Any]
    sessions: Sequence[Mapping[str, Any]]
    lines: Sequence[dict[str, Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """What a campaign is.

    Attributes:
        kind: of the campaign.
        fixed: what must not change while it is under way, besides the version of nlosim.
        growing: what may change before it goes on.
    """

    kind: Kind
    fixed: Mapping[str, Any]
    growing: Mapping[str, Any]

    def begin(self, directory: Path, session: Mapping[str, Any]) -> None:
        """Write what begins, and where, into an empty directory."""
        self._write(directory, {"nlosim": nlosim_version(), **self.fixed}, [session])

    def former(self, directory: Path) -> Former:
        """What the directory holds, if it is the same campaign.

        Raises:
            ResumeError: there is none, or another one.
        """
        kind = self.kind
        try:
            known, sessions = (
                read_json(directory / name) for name in (kind.identity, kind.sessions)
            )
            lines = read_lines(directory / kind.entries, ordered=kind.ordered).contents
        except OSError as error:
            what = f"`{directory}` holds no {kind.noun} to resume; leave `--resume` out"
            raise ResumeError(what) from error
        self._check(directory, known)
        before = sessions.get("sessions", [])
        if not isinstance(before, list) or not all(isinstance(each, dict) for each in before):
            raise ResumeError(f"`{directory / kind.sessions}` is damaged: `sessions` is no list")
        return Former(identity=known, sessions=before, lines=lines)

    def go_on(self, directory: Path, former: Former, session: Mapping[str, Any]) -> None:
        """Write what goes on, and where; remark on results of two states of code or machine."""
        if former.sessions:
            last = former.sessions[-1]
            for key, remark in self.kind.remarks.items():
                if last.get(key) != session[key]:
                    then, now = (each.get(key) or "unknown" for each in (last, session))
                    what = "`%s` %s %s; going on with %s, whose results may differ"
                    logger.warning(what, directory, remark, then, now)
        self._write(directory, former.identity, [*former.sessions, session])

    def _check(self, directory: Path, known: Mapping[str, Any]) -> None:
        fixed = {"nlosim": nlosim_version(), **self.fixed}
        new = json.loads(json.dumps(fixed))  # tuples become lists
        changed = [key for key in new if new[key] != known.get(key)]
        if changed:
            names = {"nlosim": "the version of nlosim", **self.kind.names}
            raise ResumeError(
                f"`{directory}` holds another {self.kind.noun}: "
                f"{names.get(changed[0], f'`{changed[0]}`')} changed since; only "
                f"{self.kind.growing} may be added. Choose another --out, without --resume"
            )

    def _write(
        self, directory: Path, known: Mapping[str, Any], sessions: Sequence[Mapping[str, Any]]
    ) -> None:
        files: dict[str, dict[str, Any]] = {self.kind.identity: {**known, **self.growing}}
        files.setdefault(self.kind.sessions, {})["sessions"] = sessions
        for name, content in files.items():
            write_json(directory / name, content)


def session(command: str, wording: Wording | None = None, **facts: str) -> dict[str, Any]:
    """Where the results of one start come from.

    Args:
        command: that the user gave.
        wording: how it is written down; `None`: as it is.
        facts: what else there is to say.
    """
    origin = provenance()
    host = {**origin["host"], "cpu": cpu(), "memory_gib": memory_gib()}
    if wording is not None and wording.is_private:
        command, host["name"] = wording.text(command), None
    return {"command": command, **facts, "commit": commit(), **origin, "host": host}


class Journal(abc.ABC, Generic[Entry]):
    """The finished parts of a campaign.

    Args:
        path: of the file; it is written anew, without the half line of a sudden end.
        entries: what is finished already, in the order of finishing.
    """

    def __init__(self, path: Path, entries: Iterable[Entry]) -> None:
        draft = path.with_name(f"{path.name}.draft")
        with draft.open("w", encoding="utf-8") as file:
            for entry in entries:
                self._note(entry)
                file.write(self._line(entry))
        draft.replace(path)
        self._file: TextIO = path.open("a", encoding="utf-8")

    def add(self, entry: Entry) -> None:
        """Note what is finished; when this returns, it is on the disk."""
        self._note(entry)
        self._file.write(self._line(entry))
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    @abc.abstractmethod
    def _note(self, entry: Entry) -> None:
        """Keep what is finished in mind."""

    @abc.abstractmethod
    def _content(self, entry: Entry) -> Mapping[str, Any]:
        """What the line of an entry says: plain values by their keys."""

    def _line(self, entry: Entry) -> str:
        text = json.dumps(self._content(entry), allow_nan=False)
        # the checksum is the last key, over all before it
        return f'{text[:-1]}, "{_CHECKSUM}": {zlib.crc32(text.encode())}}}\n'


@dataclass(frozen=True, slots=True)
class Lines:
    """What a journal says.

    Attributes:
        contents: of its lines.
        damaged: a sentence for each that is damaged.
    """

    contents: list[dict[str, Any]]
    damaged: list[str]


def read_lines(path: Path, *, ordered: bool = False) -> Lines:
    """The lines of a journal.

    A line that was being written when everything ended is left out, and with a warning one that is
    damaged: what it says counts as not done.

    Args:
        path: of the file.
        ordered: whether a line means nothing without those before it; then what is behind a
            damaged one is left out, too.

    Raises:
        OSError: the file cannot be read.
    """
    *lines, last = path.read_bytes().split(b"\n")
    found = Lines([], [])
    for number, line in enumerate(lines, 1):
        content = _sound(line)
        if content is not None:
            found.contents.append(content)
            continue
        rest = " with all behind it" if ordered else ""
        what = f"line {number}: damaged, and left out{rest}; `--resume` does again what it told of"
        logger.warning("`%s`, %s", path, what)
        found.damaged.append(f"`{path.name}`, {what}")
        if ordered:
            return found
    if (rest_of_line := _sound(last)) is not None:
        found.contents.append(rest_of_line)
    return found


def _sound(line: bytes) -> dict[str, Any] | None:
    """What a line says; `None` if it is damaged. Earlier releases wrote no checksums."""
    try:
        content = json.loads(line)
        if not isinstance(content, dict):
            return None
        said = content.pop(_CHECKSUM, None)
        text = json.dumps(content, allow_nan=False)
    except (ValueError, RecursionError):
        return None
    return content if said is None or zlib.crc32(text.encode()) == said else None
