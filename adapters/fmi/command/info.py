"""`nlosim fmu info`."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from adapters.fmi.archive import opened
from adapters.fmi.description import read_root
from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.errors import ComponentTypeError


def info(path: Path) -> Outcome:
    """Show the model, the platforms and the variables of an FMU."""
    try:
        found = describe(path)
    except ComponentTypeError as error:
        what = str(error).removeprefix(f"{path}: ")
        return failure("fmu", Exit.WRONG_INPUT, f"{path}: is no FMU: {what}")
    return Outcome(text=_as_text(found), data=found)


def describe(path: Path) -> dict[str, Any]:
    """What `info` shows: FMI 2.0 or 3.0, any capability, no validation.

    Raises:
        ComponentTypeError: it is no FMU.
    """
    root = read_root(path)
    with opened(path) as archive:
        names = archive.namelist()
    kinds = ("CoSimulation", "ModelExchange", "ScheduledExecution")
    return {
        "path": str(path),
        "fmi_version": root.get("fmiVersion"),
        "model": root.get("modelName"),
        "description": root.get("description", ""),
        "interfaces": [kind for kind in kinds if root.find(kind) is not None],
        **_equation(root),
        "platforms": sorted({n.split("/")[1] for n in names if n.startswith("binaries/")} - {""}),
        "has_sources": any(name.startswith("sources/") for name in names),
        "variables": [_variable(element, root) for element in root.iterfind("ModelVariables/*")],
    }


def _equation(root: ET.Element) -> dict[str, dict[str, int]]:
    """How much there is to integrate, of an FMU for Model Exchange."""
    if root.find("ModelExchange") is None:
        return {}
    structure = "ModelStructure"
    rates = (f"{structure}/Derivatives/Unknown", f"{structure}/ContinuousStateDerivative")
    listed = len(root.findall(f"{structure}/EventIndicator"))
    return {
        "model_exchange": {
            "states": sum(len(root.findall(path)) for path in rates),
            "event_indicators": int(root.get("numberOfEventIndicators") or listed),
        }
    }


def _variable(element: ET.Element, root: ET.Element) -> dict[str, Any]:
    typed = element[0] if element.tag == "ScalarVariable" and len(element) else element
    return {
        "name": element.get("name"),
        "causality": element.get("causality", "local"),
        "type": typed.tag,
        "dimensions": [_length(axis, root) for axis in element.iterfind("Dimension")],
        "unit": typed.get("unit") or _declared(typed, root).get("unit", "1"),
        "start": typed.get("start"),
        "items": _items(typed, root),
        "aliases": [alias.get("name", "") for alias in element.iterfind("Alias")],
        "description": element.get("description", ""),
    }


def _items(typed: ET.Element, root: ET.Element) -> dict[str, str | None]:
    """The values by name of an Enumeration's items; none for another type."""
    if typed.tag != "Enumeration":
        return {}
    items = _declared(typed, root).iter("Item")
    return {item.get("name", ""): item.get("value") for item in items}


def _declared(typed: ET.Element, root: ET.Element) -> ET.Element:
    """The type that a variable is declared to be of; an empty element if there is none."""
    for kind in root.iterfind("TypeDefinitions/*"):
        if kind.get("name") == typed.get("declaredType"):
            return kind[0] if kind.tag == "SimpleType" and len(kind) else kind
    return ET.Element("none")


def _length(axis: ET.Element, root: ET.Element) -> str | None:
    reference = axis.get("valueReference")
    if reference is None:
        return axis.get("start")
    found = root.find(f"ModelVariables/*[@valueReference='{reference}']")
    return None if found is None else found.get("name")


def _equation_lines(found: dict[str, Any]) -> list[str]:
    counts = found.get("model_exchange")
    if counts is None:
        return []
    said = ", ".join(f"{name.replace('_', ' ')}: {count}" for name, count in counts.items())
    is_second = "CoSimulation" in found["interfaces"]
    choice = (
        "; CoSimulation is used unless `fmi.kind` or `--kind` says otherwise" if is_second else ""
    )
    return [f"to be integrated: {said}{choice}"]


def _as_text(found: dict[str, Any]) -> str:
    lines = [
        f"{found['model']}: {found['description']}",
        f"FMI {found['fmi_version']}, {', '.join(found['interfaces'])}",
        *_equation_lines(found),
        f"platforms: {', '.join(found['platforms']) or 'none'}"
        + (" (sources included)" if found["has_sources"] else ""),
        "",
    ]
    for v in found["variables"]:
        axes = ", ".join(map(str, v["dimensions"]))
        kind = f"{v['type']}[{axes}]" if axes else v["type"]
        if v["items"]:
            kind += f" ({', '.join(f'{value} {item}' for item, value in v['items'].items())})"
        start = "" if v["start"] is None else f" = {v['start']}"
        start += "".join(f", also `{alias}`" for alias in v["aliases"])
        lines.append(
            f"{v['causality']:20} {v['name']}: {kind} [{v['unit']}]{start}  {v['description']}"
        )
    return "\n".join(lines)
