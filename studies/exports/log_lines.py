"""The lines of the log of a run."""

import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

_LINE: Final = re.compile(r"(?P<at>\S+ \S+)Z (?P<level>[A-Z]+) +(?P<name>\S+): (?P<text>.*)")
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True, kw_only=True)
class LogLine:
    """A line of a log, with the lines that continue it.

    Attributes:
        at: when it was written, by the clock, since 1970 [ns].
        level: how grave it is, as `logging` names it.
        name: who said it.
        text: what was said.
    """

    at: int
    level: str
    name: str
    text: str


def log_lines(path: Path) -> list[LogLine]:
    """The lines of the log at `path`; none if there is no log."""
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return []
    entries: list[dict[str, str]] = []
    for line in lines:
        match = _LINE.fullmatch(line)
        if match is not None:
            entries.append(match.groupdict())
        elif entries:
            entries[-1]["text"] += f"\n{line}"
    return [
        LogLine(at=_since(each["at"]), level=each["level"], name=each["name"], text=each["text"])
        for each in entries
    ]


def _since(text: str) -> int:
    since = datetime.fromisoformat(text).replace(tzinfo=UTC) - _EPOCH
    return (since.days * 86_400 + since.seconds) * 10**9 + since.microseconds * 1000
