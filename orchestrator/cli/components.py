"""`nlosim components`: component types, coupling algorithms and measures."""

from argparse import Namespace
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

from orchestrator import measure, registry
from orchestrator.absence import Need, Undriven
from orchestrator.algorithm import base
from orchestrator.cli.fitting import listed
from orchestrator.cli.outcome import Outcome
from orchestrator.cli.parameters import parameter_data, parameter_rows
from orchestrator.errors import ComponentTypeError, CosimError
from orchestrator.gaps import declared as declared_gaps
from orchestrator.local_module import is_reference, local_type
from orchestrator.parameters import REQUIRED, ComponentType, declared, description
from orchestrator.signal import Connector


def execute(arguments: Namespace) -> Outcome:
    """List all that is installed, or describe one."""
    return _all() if arguments.name is None else _one(arguments.name)


@dataclass(frozen=True, slots=True)
class _Kind:
    """Plug-ins besides component types: classes with typed parameters.

    Attributes:
        title: of several.
        key: in JSON.
        place: where a scenario says the parameters of one.
        installed: where each comes from, by name.
        load: the class of that name.
    """

    title: str
    key: str
    place: str
    installed: Callable[[], Mapping[str, str]]
    load: Callable[[str], type]

    def rows(self) -> list[dict[str, str | None]]:
        return [
            _row(name, origin, partial(self._describe, name))
            for name, origin in self.installed().items()
        ]

    def _describe(self, name: str) -> str:
        return description(self.load(name))


_KINDS: Final = (
    _Kind("coupling algorithms", "algorithms", "`coupling`", base.installed, base.algorithm_type),
    _Kind("measures", "measures", "`measures`", measure.installed, measure.measure_type),
)


def _all() -> Outcome:
    offers = registry.installed().items()
    types = [_row(name, offer.origin, partial(_description, offer)) for name, offer in offers]
    lines = _listed(types) if types else ["no component types are installed"]
    others = {kind: kind.rows() for kind in _KINDS}
    for kind, rows in others.items():
        lines += ["", f"{kind.title}:", *_listed(rows)] if rows else []
    lines += ["", "`nlosim components NAME` shows parameters and connectors."]
    data = {kind.key: rows for kind, rows in others.items()}
    return Outcome(text="\n".join(lines), data={"components": types, **data})


def _description(offer: registry.Offer) -> str:
    return offer.load().description


def _row(name: str, origin: str, describe: Callable[[], str]) -> dict[str, str | None]:
    try:
        return {"name": name, "origin": origin, "description": describe(), "error": None}
    except ComponentTypeError as problem:
        text = f"not usable: {problem}"
        return {"name": name, "origin": origin, "description": text, "error": str(problem)}


def _listed(rows: Sequence[Mapping[str, str | None]]) -> list[str]:
    width = max(len(row["name"] or "") for row in rows)
    return [f"{row['name']:<{width}}  {row['description']}" for row in rows]


def _plugin(kind: _Kind, name: str) -> Outcome:
    found = kind.load(name)
    parameters = declared(found)
    lines = [f"{name}: {description(found)}", "", f"parameters, under {kind.place}:"]
    lines += listed(parameter_rows(parameters)) or ["  none"]
    return Outcome(
        text="\n".join(lines),
        data={
            "name": name,
            "description": description(found),
            "parameters": parameter_data(parameters),
        },
    )


def _one(name: str) -> Outcome:
    for kind in _KINDS:
        if name in kind.installed() and name not in registry.installed():
            return _plugin(kind, name)
    is_path = name.endswith(".fmu") or "/" in name
    if is_reference(name):
        found = local_type(name, Path())
    else:
        found = registry.fmu_type(Path(name)) if is_path else registry.component_type(name)
    connectors, reason = _connectors(found, name)
    parameters = found.parameters
    lines = [f"{name}: {found.description}", "", "parameters:"]
    lines += listed(parameter_rows(parameters))
    lines += ["", "connectors:"]
    if reason is not None:
        lines.append(f"  known once the parameters are ({reason})")
    else:
        lines += listed([_connector_row(n, c) for n, c in connectors.items()])
        if said := declared_gaps(connectors):
            lines += ["", "an input that nothing drives:"]
            lines += listed([(gap.group, _needed(gap.undriven), gap.meaning) for gap in said])
    return Outcome(
        text="\n".join(lines),
        data={
            "name": name,
            "description": found.description,
            "parameters": parameter_data(parameters),
            "connectors": None
            if reason is not None
            else {n: _connector_data(c) for n, c in connectors.items()},
        },
    )


def _connectors(found: ComponentType, name: str) -> tuple[Mapping[str, Connector], str | None]:
    """The connectors of an instance with default parameters, or why there is none."""
    required = [n for n, p in found.parameters.items() if p.default is REQUIRED]
    if required:
        foreseen = found.foreseen_connectors()
        if foreseen is not None:
            return foreseen, None
        return {}, f"required: {', '.join(f'`{n}`' for n in required)}"
    try:
        instance = found.create("example", {})
    except (CosimError, ValueError) as error:
        return {}, str(error)
    try:
        return dict(instance.connectors), None
    finally:
        instance.close()


def _connector_row(name: str, connector: Connector) -> tuple[str, ...]:
    unit = "" if connector.unit == "1" else connector.unit
    return name, connector.causality.value, connector.kind(), unit, connector.description


_NEEDS: Final = {
    Need.ALWAYS: "is an error",
    Need.IF_OFFERED: "is an error if there is an output for it",
    Need.NEVER: "may be",
}


def _needed(said: Undriven | None) -> str:
    if said is None:
        return ""
    beside = f"; an error beside {', '.join(sorted(said.beside))}" if said.beside else ""
    return _NEEDS[said.need] + beside


def _connector_data(connector: Connector) -> dict[str, Any]:
    return {
        "causality": connector.causality.value,
        "type": connector.kind(),
        "unit": connector.unit,
        "variability": connector.variability.value,
        "feedthrough": sorted(connector.feedthrough),
        "description": connector.description,
        "undriven": None
        if (said := connector.undriven) is None
        else {
            "need": said.need.value,
            "beside": sorted(said.beside),
            "meaning": said.meaning,
        },
    }
