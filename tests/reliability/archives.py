"""Archives of FMUs, changed: `nlosim fmu info`, `fmu validate`, and `check` of a scenario."""

import random
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

from tests.reliability.archive_mutations import (
    DESCRIPTION,
    WAYS,
    Entries,
    archived,
    entries_of,
)
from tests.reliability.area import Outcome, of_cases
from tests.reliability.commands import Said, nlosim
from tests.reliability.isolation import Bounds, isolated

_ROOT: Final = Path(__file__).parents[2]
_BOUNDS: Final = Bounds(seconds=60, megabytes=4000)
_COMMANDS: Final = ("info", "validate", "check")

_SCENARIO: Final = """\
schema: 1
title: An FMU
time: {stop: 1 s}
components:
  unit: {fmu: case.fmu, step: 100 ms}
"""


@cache
def _archives() -> tuple[Entries, ...]:
    """Those that are shipped, then the units of the tests, with a library that is another one."""
    shipped = [_ROOT / f"fmus/{name}/{name}.fmu" for name in ("channel", "lidar", "perception")]
    found = [_host_only(entries_of(path.read_bytes())) for path in shipped]
    libraries = [each for each in found[1] if each[0].endswith(".so")]
    descriptions = sorted(_ROOT.glob(f"tests/adapters/fmu/*/{DESCRIPTION}"))
    units = [[(DESCRIPTION, path.read_bytes()), *libraries] for path in descriptions]
    return (*found, *units)


def _host_only(entries: Entries) -> Entries:
    """Without the libraries of other machines, which are large."""
    return [
        (name, content)
        for name, content in entries
        if not name.startswith("binaries/") or name.startswith("binaries/x86_64-linux/")
    ]


def performer(seed: int, folder: Path) -> "Perform":
    """See `isolation.isolated`."""
    perform = Perform(seed, folder)
    place = folder / "warm"
    place.mkdir()
    (place / "case.fmu").write_bytes(archived(_archives()[1]))
    for command in _COMMANDS:
        perform.said(command, place)
    shutil.rmtree(place)
    return perform


@dataclass(frozen=True, slots=True)
class Perform:
    """Performs cases of `seed` in `folder`."""

    seed: int
    folder: Path

    def drawn(self, number: int) -> tuple[str, str, random.Random]:
        """What is done to an archive, and the command that it is given to."""
        rng = random.Random(f"archives {self.seed} {number}")  # noqa: S311
        way = [*WAYS][number % len(WAYS)]
        command = _COMMANDS[number // len(WAYS) % len(_COMMANDS)]
        return way, command, rng

    def kind(self, number: int) -> str:
        """Of the case."""
        way, command, _ = self.drawn(number)
        return f"{way}, {command}"

    def __call__(self, number: int) -> Outcome:
        way, command, rng = self.drawn(number)
        place = self.folder / "temporary"
        entries = rng.choice(_archives())
        (place / "case.fmu").write_bytes(WAYS[way](entries, rng))
        said = self.said(command, place)
        allowed = {"info": (0, 2), "validate": (0, 1, 2), "check": (0, 2)}[command]
        why = said.fault(allowed)
        return Outcome(number, f"{way}, {command}", not why, why)

    def said(self, command: str, place: Path) -> Said:
        """What the command says to the archive in `place`."""
        if command == "check":
            (place / "case.yaml").write_text(_SCENARIO)
            return nlosim(["check", str(place / "case.yaml")])
        return nlosim(["fmu", command, str(place / "case.fmu")])


def _some(seed: int, numbers: Sequence[int]) -> Iterator[Outcome]:
    return isolated("tests.reliability.archives:performer", seed, numbers, _BOUNDS)


ARCHIVES: Final = of_cases(
    "archives",
    f"archives of FMUs, their ZIP structure or their model description changed in one of "
    f"{len(WAYS)} ways, given to `fmu info`, `fmu validate` and `check`",
    full=10_000,
    small=3 * len(WAYS),
    some=_some,
)
