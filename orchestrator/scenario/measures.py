"""What is asked of a run that is over, from what its manifest says."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from orchestrator.errors import CosimError
from orchestrator.measure import Measure, defaults, measure_type
from orchestrator.parameters import Parameter, declared
from orchestrator.questions import Questions
from orchestrator.report import Report, report_type
from orchestrator.scenario.values import convert
from orchestrator.suggestion import suggestion
from orchestrator.table_files import Format

ALL: Final = "all"


def questions_of(
    resolved: Mapping[str, Any],
    *,
    more: Sequence[str] = (),
    tables: Sequence[Format] | None = None,
) -> Questions:
    """What a resolved scenario asks: of one that does not speak of measures, the default ones.

    Args:
        resolved: the scenario of a manifest.
        more: names of measures to ask as well, with their defaults; `all`: the default ones, as far
            as they have an answer.
        tables: the formats of tables, instead of the scenario's.

    Raises:
        ComponentTypeError: a report or a measure is not installed, or cannot be loaded.
        CosimError: a measure in `more` is none of the default ones.
    """
    said = resolved.get("measures")
    measures = {} if said is None else {n: _measure(e) for n, e in said.items()}
    known = defaults()
    for name in more:
        if name != ALL and name not in known:
            raise CosimError(f"no measure `{name}` can be asked; {suggestion(name, (ALL, *known))}")
    usual = known if ALL in more else defaults(has_report=resolved.get("report") is not None)
    optional = usual if said is None or ALL in more else {}
    name, report = _report(resolved.get("report"))
    asked = Questions(
        report=report,
        report_name=name,
        measures={**{name: known[name] for name in more if name != ALL}, **measures},
        tables=resolved.get("tables") if tables is None else tables,
    )
    rest = {name: each for name, each in optional.items() if name not in asked.measures}
    return replace(asked, optional={} if said is None and more and ALL not in more else rest)


def _measure(entry: Mapping[str, Any]) -> Measure:
    kind = measure_type(entry["type"])
    said = {key: value for key, value in entry.items() if key != "type"}
    return kind(**_converted(declared(kind), said))


def _report(said: str | Mapping[str, Any] | None) -> tuple[str, Report | None]:
    """Its name, and it, made."""
    if said is None:
        return "", None
    entry: Mapping[str, Any] = {"type": said} if isinstance(said, str) else said
    kind = report_type(entry["type"])
    return entry["type"], kind(**_converted(declared(kind), entry.get("parameters", {})))


def _converted(parameters: Mapping[str, Parameter], said: Mapping[str, Any]) -> dict[str, Any]:
    return {key: convert(parameters[key], value, Path()) for key, value in said.items()}
