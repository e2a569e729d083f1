"""Areas `native` and `engine`: hostile lives of native units and plans under sanitizers."""

import os
import re
import select
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Final

from fmus.native.libraries import ENGINE_FOLDER
from fmus.native.unit import UNITS
from tests.reliability.area import Outcome, of_cases
from tests.reliability.episodes.calls import Table
from tests.reliability.episodes.lives import episode
from tests.reliability.episodes.sanitized import (
    build_alone,
    build_player,
    compiler,
    environment,
)

LONGEST: Final = 60.0
"""Time that an episode may take, on a machine that has other things to do [s]."""

_END: Final = re.compile(rb"end \d+ calls \d+ refused \d+ advances (\d+) wrong (\d+) mill\w+ (\d+)")
_FINDING: Final = re.compile(r"runtime error: .*|ERROR: \w+Sanitizer: .*|.*hard rss limit.*")
_MEGABYTE: Final = 1e6
_PIECE: Final = 1 << 16


class Player:
    """A process that plays episodes one after the other; started when it is needed."""

    def __init__(self, name: str, program: Path, episode_of: Callable[[int, int], bytes]) -> None:
        """Play episodes of what is called `name`, which follow from seed and number."""
        self._name = name
        self._program = program
        self._episode_of = episode_of
        self._errors = program.with_name("errors")
        self._process: subprocess.Popen[bytes] | None = None

    def play(self, seed: int, case: int) -> Outcome:
        """What becomes of an episode."""
        calls = self._episode_of(seed, case)
        process = self._started()
        begin = monotonic()
        end, said = self._lines(process, calls)
        seconds = monotonic() - begin
        if end is None:
            return self._lost(process, case, seconds)
        advances, wrong, milliseconds = map(int, end.groups())
        return Outcome(
            case=case,
            kind=f"{self._name}, {'stepped' if advances else 'refused before a step'}",
            is_expected=not wrong,
            why=said,
            seconds=milliseconds / 1e3,
            peak_mb=_peak(process.pid) / _MEGABYTE,
        )

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def _started(self) -> "subprocess.Popen[bytes]":
        if self._process is None:
            with self._errors.open("wb") as errors:
                self._process = subprocess.Popen(
                    [self._program],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=errors,
                    env=environment(),
                )
        return self._process

    def _lines(
        self, process: "subprocess.Popen[bytes]", calls: bytes
    ) -> tuple[re.Match[bytes] | None, str]:
        """How the episode ended, `None` if it did not; and the first thing that was wrong."""
        assert process.stdin is not None
        assert process.stdout is not None
        said, until = "", monotonic() + LONGEST
        try:
            _write(process, calls, until)
        except OSError:
            return None, said
        pending = b""
        while select.select([process.stdout], [], [], max(until - monotonic(), 0))[0]:
            piece = os.read(process.stdout.fileno(), _PIECE)
            if not piece:
                return None, said
            *lines, pending = (pending + piece).split(b"\n")
            for line in lines:
                if line.startswith(b"wrong") and not said:
                    said = line.decode(errors="replace").partition(": ")[2]
                if found := _END.fullmatch(line):
                    return found, said
        return None, said

    def _lost(self, process: "subprocess.Popen[bytes]", case: int, seconds: float) -> Outcome:
        """The process did not come to the end of the episode."""
        if seconds >= LONGEST:
            why = f"not done after {LONGEST:g} s"
        else:
            process.wait()
            found = _FINDING.search(self._errors.read_text(errors="replace"))
            why = found.group() if found else f"ended with code {process.returncode}"
        self.close()
        return Outcome(case, f"{self._name}, lost", is_expected=False, why=why, seconds=seconds)


def _write(process: "subprocess.Popen[bytes]", data: bytes, until: float) -> None:
    """Write what a process reads while it works; give up at `until`."""
    assert process.stdin is not None
    rest = memoryview(data)
    while rest:
        if not select.select([], [process.stdin], [], max(until - monotonic(), 0))[1]:
            return
        rest = rest[os.write(process.stdin.fileno(), rest[: select.PIPE_BUF]) :]


def _peak(pid: int) -> int:
    """The most memory that a process has had [byte]; 0 where the system does not tell."""
    try:
        found = re.search(r"VmHWM:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text())
    except OSError:
        return 0
    return int(found.group(1)) * 1024 if found else 0


def unit_player(unit: str, folder: Path) -> Player:
    """Who plays episodes of a native unit, built in `folder`."""
    return Player(unit, build_player(unit, folder), partial(episode, Table(unit)))


def engine_player(name: str, folder: Path) -> Player:
    """Who plays episodes of the engine that steps FMUs, built in `folder`."""
    source = Path(__file__).parent / "episodes" / "engine_player.c"
    return Player(name, build_alone(source, [ENGINE_FOLDER], folder), _plan)


def _plan(seed: int, case: int) -> bytes:
    """An episode of the engine, which chooses the plan itself."""
    return struct.pack("<IIQ", case, 0, seed)


def _some(
    names: Sequence[str],
    player_of: Callable[[str, Path], Player],
    seed: int,
    numbers: Sequence[int],
) -> Iterator[Outcome]:
    """Episodes of what is named, in turn."""
    with tempfile.TemporaryDirectory(prefix="nlosim-native-") as path, ExitStack() as stack:
        players: dict[str, Player] = {}
        for case in numbers:
            name = names[case % len(names)]
            if name not in players:
                folder = Path(path) / name
                folder.mkdir()
                players[name] = player_of(name, folder)
                stack.callback(players[name].close)
            yield players[name].play(seed, case)


_LEFT_OUT: Final = f"; left out by name: {compiler().lacks}" if compiler().lacks else ""

NATIVE: Final = of_cases(
    "native",
    "lives of instances of the native units under ASan and UBSan: scenes, messages and parameters "
    "at and beyond their borders, calls in any order, several instances, states that are kept, "
    f"changed and loaded{_LEFT_OUT}",
    full=12_000,
    small=210,
    some=partial(_some, UNITS, unit_player),
)

ENGINE: Final = of_cases(
    "engine",
    "plans of the engine that steps FMUs under ASan and UBSan, whose FMUs answer what they like: "
    f"numbers that are none, bytes of any size, texts that are none, any status{_LEFT_OUT}",
    full=100_000,
    small=200,
    some=partial(_some, ("engine",), engine_player),
)


def main(seed: int, case: int) -> None:
    """Play one episode and print every message of the unit: `native.py SEED CASE`."""
    unit = UNITS[case % len(UNITS)]
    with tempfile.TemporaryDirectory(prefix="nlosim-native-") as name:
        program = build_player(unit, Path(name))
        calls = episode(Table(unit), seed, case)
        subprocess.run([program, "aloud"], input=calls, env=environment(), check=False)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
