"""A scenario file, line by line, with what says each of them."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from adapters.ssp.settings import Setting
from orchestrator.errors import Location
from orchestrator.timebase import StepSize, Time, format_duration

_WORD: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_./-]*|[0-9]+ (?:s|ms|us|ns)")
_KEYWORDS: Final = frozenset({"true", "false", "null"})


@dataclass(frozen=True, slots=True, kw_only=True)
class ComponentDraft:
    """A component of a scenario.

    Attributes:
        fmu: relative to the file.
        extra: further keys, as nlosim has noted them down.
        settings: parameters by name.
    """

    name: str
    description: str
    fmu: str
    step: StepSize
    step_from: str
    extra: Mapping[str, Any]
    settings: Mapping[str, Setting]
    where: Location


@dataclass(frozen=True, slots=True, kw_only=True)
class ConnectionDraft:
    """An entry of `connections`.

    Attributes:
        entry: its keys and values.
        where: every connection that it stands for.
    """

    entry: Mapping[str, Any]
    where: tuple[Location, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Draft:
    """A scenario.

    Attributes:
        package: its name.
        head: lines of comments at the top.
        times_from: who says start and stop.
        until: the output that ends the run, or `None`.
        top: further keys of the file, as nlosim has noted them down.
    """

    package: str
    head: tuple[str, ...]
    title: str
    description: str
    start: Time
    stop: Time
    times_from: str
    until: str | None
    top: Mapping[str, Any]
    components: tuple[ComponentDraft, ...]
    connections: tuple[ConnectionDraft, ...]


@dataclass(slots=True)
class Page:
    """The text of a scenario file.

    Attributes:
        package: the name of the package, which comments leave out.
        lines: without line ends.
        origins: what says a line, by its number from 1.
    """

    package: str
    lines: list[str] = field(default_factory=list)
    origins: dict[int, Location] = field(default_factory=dict)

    def add(self, line: str, where: Location | None = None, note: str = "") -> None:
        """A line, with a comment that says where it comes from."""
        remark = (note or ("" if where is None else str(where))).replace(f"{self.package}/", "")
        self.lines.append(f"{line}  # {remark}" if remark else line)
        if where is not None:
            self.origins[len(self.lines)] = where

    @property
    def text(self) -> str:
        """All lines."""
        return "\n".join(self.lines) + "\n"


def page(draft: Draft) -> Page:
    """The scenario file of a draft."""
    made = Page(draft.package)
    for line in draft.head:
        made.add(f"# {_plain(line)}".rstrip())
    made.add("schema: 1")
    made.add(f"title: {_said(draft.title)}")
    if draft.description:
        made.add(f"description: {_said(draft.description)}")
    times = {"start": format_duration(draft.start), "stop": format_duration(draft.stop)}
    if draft.until is not None:
        times["until"] = draft.until
    made.add(f"time: {_flow(times)}", note=draft.times_from)
    for key, value in draft.top.items():
        made.add(f"{key}: {_said(value)}")
    if "coupling" not in draft.top:
        note = "SSP does not say who steps when; with `jacobi` no order matters"
        made.add("coupling: {algorithm: jacobi}", note=note)
    made.add("components:")
    for component in draft.components:
        _add_component(made, component)
    if draft.connections:
        made.add("connections:")
    for connection in draft.connections:
        first, *others = connection.where
        note = f"{first}{''.join(f', {each.line}:{each.column}' for each in others)}"
        made.add(f"  - {_flow(connection.entry)}", first, note)
    return made


def _add_component(made: Page, component: ComponentDraft) -> None:
    made.add(f"  {component.name}:", component.where)
    if component.description:
        made.add(f"    # {_plain(component.description)}")
    made.add(f"    fmu: {_said(component.fmu)}")
    made.add(f"    step: {format_duration(component.step)}", note=component.step_from)
    for key, value in component.extra.items():
        made.add(f"    {key}: {_said(value)}")
    if component.settings:
        made.add("    parameters:")
    for name, setting in component.settings.items():
        made.add(f"      {_said(name)}: {_said(setting.value)}", setting.where)


def _flow(mapping: Mapping[str, Any]) -> str:
    return "{" + ", ".join(_pairs(mapping)) + "}"


def _pairs(mapping: Mapping[str, Any]) -> Iterator[str]:
    for key, value in mapping.items():
        yield f"{key}: {_said(value)}"


def _said(value: Any) -> str:
    """A value of YAML in one line: JSON is YAML, but plain words read better."""
    if isinstance(value, str) and _WORD.fullmatch(value) and value.lower() not in _KEYWORDS:
        return value
    return json.dumps(value, ensure_ascii=False)


def _plain(text: str) -> str:
    """Text that can stand in a comment."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())
