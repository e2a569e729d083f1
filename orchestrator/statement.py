"""What two parties of a run say of a component that one has and the other uses, and how it differs.

Both must mean the same: the release, the form of messages, the scenario file, the component's entry
after what `--set` changes, its code and files, its inputs and outputs. What is compared are
digests; neither party shows the other anything of its files.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from orchestrator.errors import CosimError
from orchestrator.input_files import digest
from orchestrator.provenance import nlosim_version
from orchestrator.remote.protocol import VERSION
from orchestrator.scenario import extension
from orchestrator.scenario.absent import AbsentType
from orchestrator.scenario.model import ComponentUse, Scenario
from orchestrator.scenario.paths import anchored
from orchestrator.signal import Connector

_WHERE_IT_RUNS: Final = ("process", "host", "deadline", "memory", "on_failure")
"""Keys of a component that each party may change by itself: results do not depend on them."""

_NAMED: Final = 5
"""How many differences of one kind a message names."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Statement:
    """What one party says of one component.

    Attributes:
        nlosim: its release.
        wire: the version of its messages.
        scenario: digests of all that the scenario file says, by path, before what `--set` changes.
        entry: digests of what is said of the component, after that.
        files: digests of its code and of the files that it reads, by name; `None` if they are not
            here.
        connectors: its inputs and outputs as text, by name; `None` if they are not known.
    """

    nlosim: str
    wire: int
    scenario: Mapping[str, str]
    entry: Mapping[str, str]
    files: Mapping[str, str] | None = None
    connectors: Mapping[str, str] | None = None

    def to_document(self) -> dict[str, Any]:
        """The statement in terms of JSON."""
        return asdict(self)

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> "Statement":
        """What `to_document` described; what a stranger leaves out or adds does no harm."""
        return cls(
            nlosim=str(document.get("nlosim", "unknown")),
            wire=wire if isinstance(wire := document.get("wire"), int) else 0,
            scenario=_texts(document.get("scenario")) or {},
            entry=_texts(document.get("entry")) or {},
            files=_texts(document.get("files")),
            connectors=_texts(document.get("connectors")),
        )


def statement(
    scenario: Scenario, name: str, connectors: Mapping[str, Connector] | None = None
) -> Statement:
    """What this party says of the component `name` of `scenario`.

    Args:
        scenario: as `load_scenario` returns it.
        name: of one of its components.
        connectors: of the component, if it exists here.
    """
    use = scenario.components[name]
    said = scenario.document.data["components"][name]
    own = {key: value for key, value in said.items() if key not in _WHERE_IT_RUNS}
    is_absent = isinstance(use.type, AbsentType)
    return Statement(
        nlosim=nlosim_version(),
        wire=VERSION,
        scenario=dict(_digests(extension.read(scenario.path).data)),
        entry=dict(_digests(own)),
        files=None if is_absent else files_of(use, scenario.path.absolute().parent),
        connectors=None if connectors is None else described(connectors),
    )


def connectors_of(use: ComponentUse) -> Mapping[str, Connector] | None:
    """The connectors of a component as it would be here; `None` if it cannot be created here."""
    if isinstance(use.type, AbsentType):
        return None
    with suppress(Exception):  # reported by who has it
        component = use.type.create(use.name, anchored(use.values))
        try:
            return dict(component.connectors)
        finally:
            component.close()
    return None


def described(connectors: Mapping[str, Connector]) -> dict[str, str]:
    """Connectors as text: causality, element type, shape and unit."""
    return {name: _described(connector) for name, connector in connectors.items()}


def differences(here: Statement, there: Statement) -> list[str]:
    """What two parties do not agree upon, one sentence each; nothing if they agree.

    Args:
        here: the own statement.
        there: that of the other party.
    """
    if here.nlosim != there.nlosim or here.wire != there.wire:
        versions = f"messages of version {here.wire} and {there.wire}"
        both = f"nlosim {here.nlosim} is here and {there.nlosim} there ({versions})"
        return [f"{both}; install the same release at both ends"]
    return [
        *_differing("the scenario file differs in", here.scenario, there.scenario),
        *_differing("with what `--set` says, it differs in", here.entry, there.entry),
        *_other_files(here.files, there.files),
        *_other_connectors(here.connectors, there.connectors),
    ]


def _differing(what: str, here: Mapping[str, str], there: Mapping[str, str]) -> Iterator[str]:
    paths = [*here, *(path for path in there if path not in here)]
    found = [f"`{path}`" for path in paths if here.get(path) != there.get(path)]
    if found:
        more = f" and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
        yield f"{what} {', '.join(found[:_NAMED])}{more}"


def _other_files(here: Mapping[str, str] | None, there: Mapping[str, str] | None) -> Iterator[str]:
    if here is None or there is None:
        return  # who does not have them cannot compare them
    for name in sorted(set(here) & set(there)):  # data may be on one side only
        if here[name] != there[name]:
            yield f"the file `{name}` is not the same here and there"


def _other_connectors(
    here: Mapping[str, str] | None, there: Mapping[str, str] | None
) -> Iterator[str]:
    if here is None or there is None:
        return
    for name in [*here, *(name for name in there if name not in here)]:
        if here.get(name) != there.get(name):
            mine, theirs = here.get(name, "missing"), there.get(name, "missing")
            yield f"`{name}` is {mine} here and {theirs} there"


def _digests(data: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """A digest of every value that is no mapping, by its path."""
    if isinstance(data, Mapping) and data:
        for key, value in data.items():
            yield from _digests(value, f"{path}.{key}" if path else str(key))
    elif isinstance(data, list) and any(isinstance(each, Mapping) for each in data):
        for index, value in enumerate(data):
            yield from _digests(value, f"{path}[{index}]")
    else:
        text = json.dumps(data, sort_keys=True, ensure_ascii=False)
        yield path, hashlib.sha256(text.encode()).hexdigest()[:16]


def files_of(use: ComponentUse, folder: Path) -> dict[str, str]:
    """Digests of the component's code and files; names do not say where they are."""
    named = dict(use.type.sources)
    with suppress(CosimError, OSError, ValueError):
        for path in use.type.input_files(use.all_values()):
            whole = path.absolute()
            inside = whole.is_relative_to(folder)
            named[(whole.relative_to(folder) if inside else Path(whole.name)).as_posix()] = whole
    return {name: digest(path) for name, path in named.items() if path.is_file()}


def _described(connector: Connector) -> str:
    kind = connector.mime_type if connector.dtype is None else np.dtype(connector.dtype).str
    axes = f" [{', '.join(map(str, connector.shape))}]" if connector.shape else ""
    unit = "" if connector.unit == "1" else f" {connector.unit}"
    return f"{connector.causality.value} {kind}{axes}{unit}"


def _texts(value: Any) -> dict[str, str] | None:
    if not isinstance(value, Mapping):
        return None
    return {str(key): str(each) for key, each in value.items()}
