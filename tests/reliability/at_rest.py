"""Files of runs and experiments, damaged at rest: what is damaged is named, the rest is used."""

import json
import os
import random
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.reliability.area import Outcome, of_cases
from tests.reliability.byte_mutations import mutated_bytes, mutated_document
from tests.reliability.commands import Said, nlosim
from tests.reliability.isolation import Bounds, isolated
from tests.reliability.small_runs import written

_BOUNDS: Final = Bounds(seconds=120, megabytes=4000)


def _flip(path: Path, rng: random.Random) -> None:
    content = path.read_bytes()
    path.write_bytes(mutated_bytes(content, rng) if content else b"x")


def _cut(path: Path, rng: random.Random) -> None:
    os.truncate(path, rng.randrange(path.stat().st_size) if path.stat().st_size else 0)


def _zeros(path: Path, rng: random.Random) -> None:
    """A block of the disk reads as zeros, as after a power failure."""
    content = bytearray(path.read_bytes())
    at = rng.randrange(len(content) + 1)
    content[at : at + 512] = bytes(len(content[at : at + 512]))
    path.write_bytes(content)


def _unlink(path: Path, rng: random.Random) -> None:
    del rng
    path.unlink()


def _folder(path: Path, rng: random.Random) -> None:
    del rng
    path.unlink()
    path.mkdir()


def _other(path: Path, rng: random.Random) -> None:
    """The content of another file of the same folder."""
    others = [each for each in sorted(path.parent.iterdir()) if each.is_file()]
    shutil.copy(rng.choice(others), path.with_name("copy"))
    path.with_name("copy").replace(path)


def _document(path: Path, rng: random.Random) -> None:
    """The structure of JSON is changed; of other files, bytes are."""
    try:
        lines = [json.loads(line) for line in path.read_text().splitlines()]
        line = rng.randrange(len(lines))
        texts = [json.dumps(each).encode() for each in lines]
        texts[line] = mutated_document(lines[line], rng)
        path.write_bytes(b"\n".join([*texts, b""]))
    except ValueError:
        try:
            path.write_bytes(mutated_document(json.loads(path.read_text()), rng))
        except ValueError:
            _flip(path, rng)


def _garbage(path: Path, rng: random.Random) -> None:
    path.write_bytes(rng.randbytes(rng.choice((0, 1, 100, 5000))))


_WAYS: Final[Mapping[str, Callable[[Path, random.Random], None]]] = {
    "bytes changed": _flip,
    "cut": _cut,
    "zeros": _zeros,
    "missing": _unlink,
    "a folder in its place": _folder,
    "another file in its place": _other,
    "document changed": _document,
    "garbage": _garbage,
}

_COMMANDS: Final[Mapping[str, tuple[str, Sequence[str], Sequence[int]]]] = {
    "report": ("whole", ("report", "whole"), (0, 2)),
    "verify run": ("whole", ("verify", "run", "whole"), (0, 1, 2)),
    "export": ("whole", ("export", "whole", "--csv"), (0, 2)),
    "rerun": ("whole", ("rerun", "whole", "--out", "again", "--quiet"), (0, 1, 2)),
    "resume": ("cut", ("resume", "cut", "--quiet", "--no-figure"), (0, 2)),
    "report, experiment": ("experiment", ("report", "experiment"), (0, 2)),
    "resume, experiment": (
        "experiment",
        ("experiment", "experiment.yaml", "--out", "experiment", "--resume", "--quiet"),
        (0, 2),
    ),
}
"""By name: what is damaged, the command, and the exit codes that it may have."""


def performer(seed: int, folder: Path) -> "Perform":
    """See `isolation.isolated`: makes the runs and the experiment that are damaged."""
    source = written(folder / "source")
    os.chdir(source)
    cut = "components.noise.parameters.cut=0.55"
    commands: list[tuple[list[str], int]] = [
        (["run", "case.yaml", "--out", "whole", "--quiet"], 0),
        (["run", "case.yaml", "--out", "cut", "--quiet", "--checkpoint", "100ms", "--set", cut], 4),
        (["experiment", "experiment.yaml", "--out", "experiment", "--workers", "1", "--quiet"], 0),
    ]
    for command, code in commands:
        said = nlosim(command)
        if said.code != code:
            raise RuntimeError(f"{command} ended with {said.code}: {said.text[-500:]}")
    (source / "calm").touch()
    return Perform(seed, folder)


@dataclass(frozen=True, slots=True)
class Perform:
    """Performs cases of `seed` in `folder`."""

    seed: int
    folder: Path

    def drawn(self, number: int) -> tuple[str, str, random.Random]:
        """What is done to a file, and the command that is to read it."""
        rng = random.Random(f"at rest {self.seed} {number}")  # noqa: S311
        way = [*_WAYS][number % len(_WAYS)]
        command = [*_COMMANDS][number % len(_COMMANDS)]  # 7 and 8: every pair comes
        return way, command, rng

    def kind(self, number: int) -> str:
        """Of the case."""
        way, command, _ = self.drawn(number)
        return f"{command}: {way}"

    def __call__(self, number: int) -> Outcome:
        way, command, rng = self.drawn(number)
        place = self.folder / "temporary" / "files"
        shutil.copytree(self.folder / "source", place)
        os.chdir(place)
        victim, arguments, allowed = _COMMANDS[command]
        path = rng.choice([each for each in sorted((place / victim).rglob("*")) if each.is_file()])
        before = path.read_bytes()
        _WAYS[way](path, rng)
        changed = not path.is_file() or path.read_bytes() != before
        said = nlosim(arguments)
        why = said.fault(allowed) or _unsaid(
            way, command, path.relative_to(place), said, is_changed=changed
        )
        shutil.rmtree(place, ignore_errors=True)
        if why:
            why = f"{path.relative_to(place)}: {why}"
        return Outcome(number, f"{command}: {way}", not why, why)


def _unsaid(way: str, command: str, path: Path, said: Said, *, is_changed: bool) -> str:
    """What is missing in what was said.

    A sound file of something else is not damaged: that all of them do not fit is what can be said.
    """
    victim, is_sound = path.parts[0], way in {"another file in its place", "document changed"}
    if said.code and victim not in said.text and not is_sound:
        return f"exit code {said.code}, and `{victim}` is not named: {said.text[-200:]!r}"
    if path.suffix == ".zst" and is_changed and command == "verify run":
        if not said.code:
            return "it says that nothing is damaged"
        if path.stem.removesuffix(".rows") not in said.text and not is_sound:
            return f"it does not name the file: {said.text[-200:]!r}"
    return ""


def _some(seed: int, numbers: Sequence[int]) -> Iterator[Outcome]:
    return isolated("tests.reliability.at_rest:performer", seed, numbers, _BOUNDS)


AT_REST: Final = of_cases(
    "at-rest",
    "recordings, manifests, checkpoints, tables and journals, a file of which was damaged in one "
    f"of {len(_WAYS)} ways: report, verify run, export, rerun and resume name it, and use the rest",
    full=5_000,
    small=14,
    some=_some,
)
