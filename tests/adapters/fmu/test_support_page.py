"""The page on what of FMI is supported is complete, and says what FMUs see."""

import io
import itertools
import re
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from lxml import etree

from adapters.fmi import FmuComponentType
from adapters.fmi.unpacked import LoadedFmu
from fmus.native.unit import fmi_headers
from orchestrator.capabilities import AdjointDerivatives, DirectionalDerivatives, PortableState
from orchestrator.component import Component, RestorableComponent
from orchestrator.errors import CosimError
from orchestrator.signal import Causality, Signal

PAGE = Path(__file__).parents[3] / "docs" / "fmi-support.md"
SCHEMAS = Path(fmpy.__file__).parent / "schema"
BORROWED = {"Model Exchange only", "for extrapolation and interpolation"}
"""What other interfaces and algorithms call."""
S = 1_000_000_000


def tables(title: str) -> Iterator[tuple[list[str], str]]:
    """The rows below a title: the names in the first cell, and the second cell."""
    text = PAGE.read_text(encoding="utf-8")
    section = re.split(r"^## ", text.split(f"## {title}\n")[1], flags=re.MULTILINE)[0]
    for line in section.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        names = re.findall(r"`([^`]+)`", cells[0])
        if line.startswith("| `") and len(cells) == 2:
            yield [each for name in names for each in expanded(name)], cells[1]


def expanded(name: str) -> list[str]:
    """`a{b,c}d` is `abd` and `acd`."""
    parts = [part.split(",") for part in re.split(r"[{}]", name)]
    return ["".join(each) for each in itertools.product(*parts)]


def listed(title: str) -> list[str]:
    return [name for names, _ in tables(title) for name in names]


@pytest.mark.parametrize("version", [2, 3])
def test_every_function_of_the_headers_is_listed_once(version: int) -> None:
    header = (Path(fmi_headers()) / f"fmi{version}Functions.h").read_text(encoding="utf-8")
    exported = re.findall(rf"FMI{version}_Export\s+fmi{version}\w+TYPE\s+(fmi{version}\w+)", header)
    found = [name for name in listed("Functions") if name.startswith(f"fmi{version}")]
    assert sorted(found) == sorted(exported)


def attributes(path: Path) -> set[str]:
    """The attributes that a schema declares."""
    root = etree.parse(str(path)).getroot()
    return {str(a.get("name")) for a in root.iter("{*}attribute")}


def test_every_capability_flag_is_listed() -> None:
    flags = attributes(SCHEMAS / "fmi3" / "fmi3InterfaceType.xsd")
    model = etree.parse(str(SCHEMAS / "fmi2" / "fmi2ModelDescription.xsd")).getroot()
    for interface in ("ModelExchange", "CoSimulation"):
        for element in model.iterfind(f".//{{*}}element[@name='{interface}']"):
            flags |= {str(a.get("name")) for a in element.iter("{*}attribute")}
    assert set(listed("Capability flags")) == flags - {"name"}  # of source files


def test_every_attribute_of_variables_is_listed() -> None:
    found: set[str] = set()
    for name in ("fmi3Variable", "fmi3AttributeGroups"):
        found |= attributes(SCHEMAS / "fmi3" / f"{name}.xsd")
    for name in ("fmi2ScalarVariable", "fmi2AttributeGroups"):
        found |= attributes(SCHEMAS / "fmi2" / f"{name}.xsd")
    assert set(listed("Variables")) == found


def lived(path: Path, values: dict[str, Any], ticking: str = "") -> None:
    """Let an FMU do everything that it can do."""
    component = FmuComponentType(path).create("unit", values)
    component.setup(0, np.random.default_rng(1))
    inputs: dict[str, Signal] = {
        n: c.start_value()
        for n, c in component.connectors.items()
        if c.causality is Causality.INPUT
    }
    component.initialise(inputs)
    if ticking:
        inputs[ticking] = np.array(True)
    for t in range(2):
        component.step({n: _again(v) for n, v in inputs.items()}, t * S, S)
    if isinstance(component, RestorableComponent):
        component.restore(component.save())
    use(component)
    component.close()


def _again(value: Signal) -> Signal:
    return value if isinstance(value, bytes) else value.copy()


def use(component: Component) -> None:
    """Use the capabilities of a component."""
    portable = component.capability(PortableState)  # type: ignore[type-abstract]
    if portable is not None:
        portable.load(portable.dump())
    directional = component.capability(DirectionalDerivatives)  # type: ignore[type-abstract]
    if directional is not None:
        known = {"p": np.array(1.0)} if "p" in component.connectors else {"a": np.array(1.0)}
        directional.directional(known)
    adjoint = component.capability(AdjointDerivatives)  # type: ignore[type-abstract]
    if adjoint is not None:
        adjoint.adjoint({"z": np.array(1.0)})


def test_functions_are_called_as_the_page_says(
    request: pytest.FixtureRequest,
    fmu: Callable[[str], Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By the test FMUs together, one without fractions and one that discards a step included."""
    called: set[str] = set()

    def watched(original: Callable[..., Any]) -> Callable[..., Any]:
        def call(self: LoadedFmu, name: str, *arguments: Any) -> Any:
            called.add(name)
            return original(self, name, *arguments)

        return call

    for method in ("call", "function", "address_of"):
        monkeypatch.setattr(LoadedFmu, method, watched(getattr(LoadedFmu, method)))
    given = {name: request.getfixturevalue(name) for name in FMUS}
    for name, (values, ticking) in FMUS.items():
        lived(given[name], values, ticking)
    for name in ("mirror", "matrix", "weights"):
        lived(fmu(name), {"n_out": 2, "w": (1.0,)} if name == "weights" else {})
    altered = tmp_path / "decimal.fmu"
    altered.write_bytes(without(given["clocks3"], b'supportsFraction="true"'))
    lived(altered, {})
    with pytest.raises(CosimError):
        lived(given["lag2"], {"fail_at": 0.5, "fail_as": 2})
    said = {n: what for names, what in tables("Functions") for n in names}
    borrowed = {n for n, what in said.items() if what in BORROWED}
    assert called - borrowed == {n for n, what in said.items() if what.startswith("called")}
    rest = {what.split(":")[0] for n, what in said.items() if n not in called | borrowed}
    assert rest == {"not called"}


FMUS: dict[str, tuple[dict[str, Any], str]] = {
    "bilinear3": ({}, ""),
    "product2": ({}, ""),
    "lag2": ({}, ""),
    "words3": ({}, ""),
    "events3": ({"fmi.event_mode": True, "period": 0.4}, ""),
    "clocks3": ({}, "pull"),
    "partitions3": ({}, "pull"),
}
"""Parameters, and a clock that is triggered."""


def without(path: Path, text: bytes) -> bytes:
    """The archive with a text removed from its description."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(buffer, "w") as new:
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(text, b""))
    return buffer.getvalue()
