"""`nlosim scenarios`."""

import shutil
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator.cli.outcome import Outcome
from orchestrator.errors import CosimError, ScenarioError
from orchestrator.scenario import extension
from orchestrator.scenario.installed import (
    SUFFIXES,
    InstalledScenario,
    installed,
    installed_scenario,
)
from orchestrator.tables import lines as aligned


class NotCopiedError(CosimError):
    """A copy would write over somebody's file."""


def execute(arguments: Namespace) -> Outcome:
    """List the installed scenarios, or copy one."""
    if arguments.copy is None:
        return _listed()
    name, directory = arguments.copy
    return _copied(installed_scenario(name), Path(directory))


def _listed() -> Outcome:
    found = [scenario for offers in installed().values() for scenario in offers]
    rows = [_row(scenario) for scenario in found]
    lines = aligned([(row["name"], row["title"] or row["error"], row["path"]) for row in rows])
    hint = "`nlosim run NAME` runs one; `nlosim scenarios --copy NAME DIR` copies it, to be edited."
    return Outcome(
        text="\n".join([*lines, "", hint]) if rows else "no scenarios are installed",
        data={"scenarios": rows},
    )


def _row(scenario: InstalledScenario) -> dict[str, Any]:
    title, error = None, None
    try:
        title = str(extension.read(scenario.path).data["title"])
    except (ScenarioError, KeyError, TypeError) as problem:
        error = f"not usable: {problem}"
    path = str(scenario.path)
    return {
        "name": scenario.name,
        "title": title,
        "package": scenario.package,
        "path": path,
        "error": error,
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class _Copy:
    """One file to copy."""

    source: Path
    target: Path

    def is_in_the_way(self) -> bool:
        """Whether something else is where the copy goes."""
        target = self.target
        if not target.exists():
            return False
        return not target.is_file() or target.read_bytes() != self.source.read_bytes()

    def make(self) -> None:
        self.target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(self.source, self.target)


def _copied(scenario: InstalledScenario, directory: Path) -> Outcome:
    """Copy a scenario, the files that it extends and what lies beside it in its package."""
    copies = [
        _Copy(source=source, target=directory / source.relative_to(scenario.path.parent))
        for source in _files(scenario)
    ]
    if taken := [copy.target for copy in copies if copy.is_in_the_way()]:
        raise NotCopiedError(f"`{taken[0]}` is there already; copy to another directory")
    for copy in copies:
        copy.make()
    path = directory / scenario.path.name
    written = [str(copy.target) for copy in copies]
    text = f"{len(written)} files in {directory}; run it with: nlosim run {path}"
    return Outcome(text=text, data={"path": str(path), "files": written})


def _files(scenario: InstalledScenario) -> Iterator[Path]:
    """The scenario and what it extends within its package, and all that is neither YAML nor Python.

    What of the package's data a scenario needs only its components know, so all of it is taken.
    """
    needed = {Path(name).resolve() for name in extension.read(scenario.path).folders}
    for path in sorted(scenario.path.parent.rglob("*")):
        is_other_scenario = path.suffix in SUFFIXES and path.resolve() not in needed
        if path.is_file() and path.suffix not in {".py", ".pyc"} and not is_other_scenario:
            yield path
