"""Packages that tests have installed: in this process, or in a folder for another one."""

from collections.abc import Iterable, Mapping
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

import orchestrator.scenario.installed  # noqa: F401 - has the function before it is replaced
from orchestrator import installed, registry
from orchestrator.algorithm import base

Groups = Mapping[str, Mapping[str, str]]
"""Entry points: by group and name what they stand for, `module:Class`."""


def install(monkeypatch: pytest.MonkeyPatch, groups: Groups) -> None:
    """Install these, and no others but the coupling algorithms."""
    offered = installed.entry_points

    def entry_points(group: str) -> Iterable[EntryPoint]:
        if group == base.GROUP:
            return offered(group)
        return [EntryPoint(name, value, group) for name, value in groups.get(group, {}).items()]

    monkeypatch.setattr(registry, "entry_points", entry_points)
    monkeypatch.setattr(installed, "entry_points", entry_points)


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
