"""Scenario, experiment and training files and `--set`, changed: refused well, or accepted."""

import os
import random
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

import yaml

from orchestrator.cli.failures import outcome_of
from tests.reliability.area import Outcome, of_cases
from tests.reliability.commands import Said, nlosim, told
from tests.reliability.isolation import Bounds, isolated
from tests.reliability.yaml_mutations import WAYS, addresses, mutated, odd_value

_ROOT: Final = Path(__file__).parents[2]
_BOUNDS: Final = Bounds(seconds=60, megabytes=4000)
_MOST_MEMORY: Final = 1500.0
"""More than that for a file of 16 MB at most is too much [MB]."""


@dataclass(frozen=True, slots=True)
class Case:
    """A file to be changed, and how.

    Attributes:
        file: relative to the repository; the file that is read.
        changed: likewise; the file that is changed: it, or one that it extends.
        way: what is done, one of `WAYS` or `--set`.
        rng: for the change.
    """

    file: str
    changed: str
    way: str
    rng: random.Random

    @property
    def kind(self) -> str:
        """Its row in the table."""
        what = {"experiments": "experiment", "recipes": "training"}.get(
            Path(self.file).parent.name, "scenario"
        )
        extended = "" if self.file == self.changed else ", in a file it extends"
        return f"{what}: {self.way}{extended}"


@cache
def _files() -> tuple[str, ...]:
    found = [*_ROOT.glob("scenarios/*.yaml"), *_ROOT.glob("studies/**/*.yaml")]
    return tuple(sorted(str(path.relative_to(_ROOT)) for path in found))


def drawn(seed: int, number: int) -> Case:
    """The case of that number: every file and every way in turn, at random together."""
    rng = random.Random(f"scenarios {seed} {number}")  # noqa: S311 - no secret
    ways = (*WAYS, "--set")
    way = ways[number % len(ways)]
    file = rng.choice(_files())
    base = file
    if way != "--set" and rng.random() < 0.2:
        base = _extended(file) or file
    if way == "--set":
        file = base = rng.choice([f for f in _files() if f.startswith("scenarios/")])
    return Case(file, base, way, rng)


def _extended(file: str) -> str:
    """What `file` extends, or the scenario that it is about."""
    data = yaml.safe_load((_ROOT / file).read_text())
    name = data.get("extends") or data.get("scenario")
    if not isinstance(name, str):
        return ""
    path = (_ROOT / file).parent / name
    return os.path.relpath(path, _ROOT) if path.is_file() else ""


def performer(seed: int, folder: Path) -> "Perform":
    """See `isolation.isolated`."""
    from studies.training import load  # noqa: F401, PLC0415 - imported before copies are made

    nlosim(["check", str(_ROOT / "scenarios/red_light.yaml")])
    return Perform(seed, folder)


@dataclass(frozen=True, slots=True)
class Perform:
    """Performs cases of `seed` in `folder`."""

    seed: int
    folder: Path

    def kind(self, number: int) -> str:
        """Of the case."""
        return drawn(self.seed, number).kind

    def __call__(self, number: int) -> Outcome:
        case = drawn(self.seed, number)
        place = self.folder / "temporary" / "files"
        try:
            why = _said(case, place).fault()
        except BaseException as error:
            why = f"it raised {error!r}"[:300]
        shutil.rmtree(place, ignore_errors=True)
        return Outcome(number, case.kind, not why, why)


def _said(case: Case, place: Path) -> Said:
    if case.way == "--set":
        return nlosim(["check", str(_ROOT / case.file), *_settings(case)])
    _linked(place, case.changed)
    text = mutated((_ROOT / case.changed).read_bytes(), case.way, case.rng)
    (place / case.changed).write_bytes(text)
    file = place / case.file
    if file.parent.name == "experiments":
        return _loaded(file, _load_experiment)
    if file.parent.name == "recipes":
        return _loaded(file, _load_training)
    return nlosim(["check", str(file)])


def _settings(case: Case) -> list[str]:
    """Arguments `--set`, at addresses of the file and elsewhere, of any value."""
    rng = case.rng
    data = yaml.safe_load((_ROOT / case.file).read_text())
    found: list[str] = []
    for _ in range(rng.choice((1, 1, 2, 3))):
        address = ".".join(map(str, rng.choice(addresses(data))))
        if rng.random() < 0.2:
            address = rng.choice(
                ("", ".", "a..b", address + ".x", "components", "a" * 10_000, "schema")
            )
        value = rng.choice(
            (
                lambda: yaml.safe_dump(odd_value(rng), default_flow_style=True).strip(),
                lambda: rng.choice(
                    ("[", "{a: ", "&a [*a]", "*x", "!!x y", "'", "\t", "- a\n- b", "")
                ),
                lambda: str(odd_value(rng)),
            )
        )()
        text = address + rng.choice(("=", "=", "=", "==", "")) + value
        found += ["--set", text.replace("\0", "")]
    return found


def _linked(place: Path, file: str) -> None:
    """Make `place` the repository, but for `file`, which is to be written."""
    source, target = _ROOT, place
    for part in Path(file).parts:
        target.mkdir(parents=True)
        for path in source.iterdir():
            if path.name != part:
                (target / path.name).symlink_to(path)
        source, target = source / part, target / part


def _load_experiment(file: Path) -> None:
    from orchestrator.experiment.load import load_experiment  # noqa: PLC0415

    load_experiment(file)


def _load_training(file: Path) -> None:
    from studies.training.load import load_training  # noqa: PLC0415

    load_training(file)


def _loaded(file: Path, load: Callable[[Path], None]) -> Said:
    """What the command says that would run what `file` says."""
    with told() as text:
        try:
            load(file)
        except BaseException as error:
            outcome = outcome_of(error)
            return Said(int(outcome.exit_code), outcome.text)
    return Said(0, "".join(text))


def _some(seed: int, numbers: Sequence[int]) -> Iterator[Outcome]:
    for outcome in isolated("tests.reliability.scenarios:performer", seed, numbers, _BOUNDS):
        if outcome.is_expected and outcome.peak_mb > _MOST_MEMORY:
            why = f"{outcome.peak_mb:.0f} MB of memory"
            yield Outcome(
                outcome.case, outcome.kind, False, why, "", outcome.seconds, outcome.peak_mb
            )
        else:
            yield outcome


SCENARIOS: Final = of_cases(
    "scenarios",
    "scenario, experiment and training files and `--set`, changed in one of 15 ways: exit code 0, "
    "or 2 and a message with the place, within 60 s and 1.5 GB",
    full=10_000,
    small=15,
    some=_some,
)
