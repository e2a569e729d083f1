"""Opening a scene in SUMO, in a process of its own that may crash, without writing its outputs."""

import json
import re
import signal
import subprocess
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypeAlias

from adapters.sumo.files import SceneFiles
from adapters.sumo.silencing import StandIns
from orchestrator.errors import Location, Problem
from orchestrator.process_end import ended
from orchestrator.remote.process import child_environment
from orchestrator.scratch import scratch

_MODULE: Final = "adapters.sumo.probe_main"
_MESSAGE: Final = re.compile(r"(Error|Warning): ?(.*)")
_FILE: Final = re.compile(r"[Ff]ile '([^']+)'")
_PLACE: Final = re.compile(r"\(?\s*[Aa]t line/column (\d+)/(\d+)\)?\.?|in line (\d+), column (\d+)")
_IN_FILE: Final = re.compile(r"\s*In file '[^']+'")
_NOT_SAID: Final = "Process Error"
"""The text of an exception when the reason is on standard error only."""

_NAMED: Final = re.compile(r"([A-Za-z]+) '([^']+)'")
_NAMES: Final = MappingProxyType(
    {
        "vehicle": ("vehicle", "flow"),
        "trip": ("vehicle", "flow"),
        "flow": ("flow",),
        "person": ("person", "personFlow"),
        "vtype": ("vehicle type",),
        "route": ("route",),
        "polygon": ("polygon",),
    }
)
"""SUMO's nouns in front of ids, and which ids these can be; see `Declarations`."""

Declarations: TypeAlias = Mapping[tuple[str, str], Location]
"""Where the files of a scene declare ids, by kind and id."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Probe:
    """What SUMO says about a scene.

    Attributes:
        problems: its errors, or that it crashed or did not come to an end.
        remarks: its warnings.
    """

    problems: tuple[Problem, ...]
    remarks: tuple[Problem, ...]


def probe(
    files: SceneFiles, declared: Declarations | None = None, *, timeout: float = 300.0
) -> Probe:
    """Open a scene in SUMO and simulate one step.

    Args:
        files: of the scene.
        declared: where its files declare the ids that SUMO may name.
        timeout: for the whole [s].

    Returns:
        SUMO's own words, at the places or else at the ids that they name, or at the configuration.
        Nothing that the scene writes is written.
    """
    with scratch("scene") as folder:
        stand_ins = StandIns(files, folder)
        attempt = _attempt(stand_ins.options(), folder, timeout)
        crash = attempt.crashed and attempt.stage == "loading" and files.net is not None
        is_net = crash and _attempt(_net_only(files), folder, timeout).crashed
    guilty = files.net if is_net and files.net is not None else files.config
    reader = _Reader(files, stand_ins.originals, declared or {})
    return reader.probe(attempt, guilty, timeout)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Attempt:
    """How a process that opens a scene ended.

    Attributes:
        stage: `loading`, `stepping`, `done`; empty if it did not get so far.
        error: the text of SUMO's exception.
        printed: what it wrote to standard error.
        code: its exit code; negative for a signal that ended it.
        is_late: whether it was ended because time was up.
    """

    stage: str
    error: str | None
    printed: str
    code: int
    is_late: bool

    @property
    def crashed(self) -> bool:
        """Whether SUMO ended the process, without a word of its own."""
        return bool(self.stage) and self.stage != "done" and self.error is None and self.code != 0


def _attempt(options: Iterable[str], folder: Path, timeout: float) -> _Attempt:
    result = folder / "result.json"
    result.unlink(missing_ok=True)
    command = [sys.executable, "-P", "-m", _MODULE, str(result), *options]
    code, is_late = 0, False
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            timeout=timeout,
            check=False,
            env=child_environment(),
        )
        raw, code = done.stderr, done.returncode
    except subprocess.TimeoutExpired as late:
        raw, is_late = late.stderr or b"", True
    noted: Mapping[str, Any] = json.loads(result.read_text("utf-8")) if result.exists() else {}
    return _Attempt(
        stage=noted.get("stage", ""),
        error=noted.get("error"),
        printed=raw.decode("utf-8", errors="replace"),
        code=code,
        is_late=is_late,
    )


def _net_only(files: SceneFiles) -> list[str]:
    return ["--net-file", str(files.net)]


@dataclass(frozen=True, slots=True)
class _Reader:
    """Reads what SUMO says."""

    files: SceneFiles
    originals: Mapping[str, Path]
    declared: Declarations

    def probe(self, attempt: _Attempt, guilty: Path, timeout: float) -> Probe:
        said = _messages(attempt.printed)
        errors = [text for kind, text in said if kind == "Error"]
        if attempt.error is not None and (_NOT_SAID not in attempt.error or not errors):
            errors.append(attempt.error)
        problems = self._located(errors)
        if not problems and (what := _end(attempt, guilty, timeout)):
            problems.append(Problem(Location(str(guilty), 1, 1), what))
        remarks = self._located([text for kind, text in said if kind == "Warning"])
        return Probe(problems=tuple(problems), remarks=tuple(remarks))

    def _located(self, messages: Iterable[str]) -> list[Problem]:
        return [self._problem(text) for text in dict.fromkeys(map(str.strip, messages))]

    def _problem(self, text: str) -> Problem:
        """One of SUMO's messages at the place that it names."""
        file, place = _FILE.search(text), _PLACE.search(text)
        if file is not None:
            line, column = _numbers(place)
            path = self.originals.get(file[1], Path(file[1]))
            where = Location(str(path), line, column)
        else:
            where = self._declaration(text)
        for copy, original in self.originals.items():
            text = text.replace(copy, str(original))
        what = text if place is None else _PLACE.sub("", _IN_FILE.sub("", text))
        return Problem(where, f"SUMO: {' '.join(what.split())}")

    def _declaration(self, text: str) -> Location:
        """Where the first id that a message names is declared, or the configuration."""
        for noun, name in _NAMED.findall(text):
            for kind in _NAMES.get(noun.lower(), ()):
                member_of = name.rpartition(".")[0]  # vehicles of a flow are numbered
                for each in (name, member_of):
                    if where := self.declared.get((kind, each)):
                        return where
        return Location(str(self.files.config), 1, 1)


def _end(attempt: _Attempt, guilty: Path, timeout: float) -> str | None:
    """How an attempt ended about which SUMO says nothing; `None` if it went well."""
    stepping = attempt.stage == "stepping"
    doing = "simulating its first step" if stepping else f"loading {guilty.name}"
    if attempt.is_late:
        return f"SUMO was still {doing} after {timeout:g} s"
    if attempt.crashed:
        number = -attempt.code
        is_signal = number > 0
        how = f"signal {number}, {signal.Signals(number).name}" if is_signal else f"code {-number}"
        return f"SUMO crashed while {doing} ({how})"
    if attempt.stage != "done":
        said = attempt.printed.strip().rpartition("\n")[2]
        return f"SUMO could not be started: {said or f'its process {ended(attempt.code)}'}"
    return None


def _numbers(place: re.Match[str] | None) -> tuple[int, int]:
    """The line and the column that a message says; 1 and 1 if it says none."""
    if place is None:
        return 1, 1
    line, column = (int(number) for number in place.groups() if number is not None)
    return line, column


def _messages(printed: str) -> list[tuple[str, str]]:
    """SUMO's errors and warnings, in their order; further lines of one begin with a space."""
    found: list[tuple[str, str]] = []
    is_message = False
    for line in printed.splitlines():
        match = _MESSAGE.match(line)
        if match is not None:
            kind, text = match.groups()
            if found and _PLACE.fullmatch(text.strip()):  # the place of the error before
                found[-1] = (found[-1][0], f"{found[-1][1]}\n{text}")
            else:
                found.append((kind, text))
            is_message = True
        elif is_message and line.startswith(" "):
            found[-1] = (found[-1][0], f"{found[-1][1]}\n{line}")
        else:
            is_message = False
    return found
