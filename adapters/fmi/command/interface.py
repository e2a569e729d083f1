"""`nlosim fmu run`: which interface of the FMU is used, and how it is integrated."""

from argparse import Namespace
from collections.abc import Mapping
from typing import Any

from adapters.fmi.command.span import RunError
from adapters.fmi.kind import Kind
from adapters.fmi.options import PREFIX
from orchestrator.parameters import ComponentType

_INTEGRATION = ("solver", "solver-step")


def interface_options(arguments: Namespace, type_: ComponentType) -> dict[str, Any]:
    """The parameters `fmi.*` that the command line says.

    Args:
        arguments: with `kind`, `solver`, `tolerance` and `solver_step`, each a text or `None`, and
            `logging`.
        type_: the FMU.

    Raises:
        RunError: a number is none, or the FMU does not have what is asked for.
    """
    problems: list[str] = []
    said = {
        "kind": arguments.kind,
        "solver": arguments.solver,
        "tolerance": _number("--tolerance", arguments.tolerance, problems),
        "step": _number("--solver-step", arguments.solver_step, problems),
        "logging": arguments.logging or None,
    }
    asks = [f"--{name}" for name in _INTEGRATION if getattr(arguments, name.replace("-", "_"))]
    if asks and arguments.kind not in {None, Kind.MODEL_EXCHANGE.value}:
        problems.append(f"{asks[0]} is for Model Exchange, not for --kind {arguments.kind}")
    elif asks:
        said["kind"] = Kind.MODEL_EXCHANGE.value
    problems += _missing(said["kind"], asks, type_)
    if problems:
        raise RunError("\n".join(problems))
    found = {PREFIX + name: value for name, value in said.items() if value is not None}
    return {name: value for name, value in found.items() if name in type_.parameters}


def _missing(kind: str | None, asks: list[str], type_: ComponentType) -> list[str]:
    offered = type_.parameters.get(PREFIX + "kind")
    kinds = offered.type.__args__ if offered is not None else (Kind.CO_SIMULATION.value,)
    if kind is None or kind in kinds:
        return []
    asked = asks[0] if asks else f"--kind {kind}"
    return [f"{asked}: the FMU has no {Kind(kind).words}, only {Kind(kinds[0]).words}"]


def _number(option: str, text: str | None, problems: list[str]) -> float | None:
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        problems.append(f"{option} {text}: write a number greater than 0")
    return value


def used_text(type_: ComponentType, options: Mapping[str, Any]) -> str:
    """How the FMU was integrated, to be appended to a line; empty for Co-Simulation."""
    offered = type_.parameters.get(PREFIX + "kind")
    if offered is None:
        return ""
    kind = Kind(options.get(PREFIX + "kind", offered.default))
    solver = options.get(PREFIX + "solver", type_.parameters[PREFIX + "solver"].default)
    return f", {kind.words} by {solver}" if kind is Kind.MODEL_EXCHANGE else ""
