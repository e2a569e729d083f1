"""Packages that tests have installed: in this process, or in a folder for another one."""

from collections.abc import Mapping
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from typing import Final

import pytest

from adapters.fmu_command import ACTIONS
from orchestrator import installed
from orchestrator.algorithm import base
from orchestrator.cli.parser import COMMANDS
from orchestrator.recording.tidy import GROUP as TIDIERS
from orchestrator.scenario.installed import SCENARIOS
from studies.verification.command import VERIFICATIONS

STAYING: Final = (base.GROUP, COMMANDS, ACTIONS, SCENARIOS, VERIFICATIONS, TIDIERS)
"""What the program itself is made of: algorithms, commands and their parts, scenarios, tables."""

Groups = Mapping[str, Mapping[str, str]]
"""Entry points: by group and name what they stand for, `module:Class`."""


def install(monkeypatch: pytest.MonkeyPatch, groups: Groups) -> None:
    """Install these, alone in their groups; what `STAYING` names is there unless given."""
    entries = [
        *(
            entry
            for group in STAYING
            if group not in groups
            for entry in installed.entry_points(group)
        ),
        *(
            EntryPoint(name, value, group)
            for group, offered in groups.items()
            for name, value in offered.items()
        ),
    ]
    found = EntryPoints(entries)
    monkeypatch.setattr(installed, "_of", lambda group, path: found.select(group=group))


def site(folder: Path, package: str, groups: Groups) -> Path:
    """A folder, made in `folder`, that Python takes for one in which `package` is installed."""
    info = folder / "site" / f"{package}-1.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1\n")
    lines = [
        line
        for group, entries in groups.items()
        for line in (f"[{group}]", *(f"{name} = {value}" for name, value in entries.items()))
    ]
    (info / "entry_points.txt").write_text("\n".join(lines))
    return info.parent
