"""Packages for tests, of FMUs that are described and cannot run."""

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path

HOME = "http://ssp-standard.org/SSP1/SystemStructure"
SPACES = " ".join(
    f'xmlns:{prefix}="{HOME}{name}"'
    for prefix, name in (
        ("ssc", "Common"),
        ("ssd", "Description"),
        ("ssv", "ParameterValues"),
        ("ssm", "ParameterMapping"),
        ("ssb", "SignalDictionary"),
    )
)
KMH = 'm="1" s="-1" factor="0.277777777777777777777777777778"'
UNITS = f"""\
  <ssd:Units>
    <ssc:Unit name="m/s"><ssc:BaseUnit m="1" s="-1"/></ssc:Unit>
    <ssc:Unit name="km/h"><ssc:BaseUnit {KMH}/></ssc:Unit>
    <ssc:Unit name="degC"><ssc:BaseUnit K="1" offset="273.15"/></ssc:Unit>
    <ssc:Unit name="K"><ssc:BaseUnit K="1"/></ssc:Unit>
    <ssc:Unit name="mm/s"><ssc:BaseUnit m="1" s="-1" factor="0.001"/></ssc:Unit>
  </ssd:Units>
"""
_UNITS_OF_FMU = """\
  <UnitDefinitions>
    <Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit>
    <Unit name="mm/s"><BaseUnit m="1" s="-1" factor="0.001"/></Unit>
    <Unit name="K"><BaseUnit K="1"/></Unit>
    <Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>
  </UnitDefinitions>
  <TypeDefinitions>
    <SimpleType name="Gear">
      <Enumeration><Item name="low" value="1"/><Item name="high" value="2"/></Enumeration>
    </SimpleType>
  </TypeDefinitions>
"""


def variable(name: str, says: str, reference: int) -> str:
    """A variable of an FMI 2.0 FMU: `input Real m/s`, `parameter Integer`, ..."""
    causality, type_, *unit = says.split()
    start = {"Real": "1", "Integer": "1", "Boolean": "false", "String": "x", "Enumeration": "1"}
    attributes = f' unit="{unit[0]}"' if unit else ""
    attributes += ' declaredType="Gear"' if type_ == "Enumeration" else ""
    calculated = causality in {"output", "local"}
    variability = {"parameter": "fixed"}.get(
        causality, "continuous" if type_ == "Real" else "discrete"
    )
    attributes += "" if calculated else f' start="{start[type_]}"'
    initial = ' initial="calculated"' if calculated else ""
    return (
        f'    <ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}"'
        f' variability="{variability}"{initial}><{type_}{attributes}/></ScalarVariable>\n'
    )


def fmu(*, experiment: str = "", **variables: str) -> bytes:
    """An FMI 2.0 FMU without binaries, as a file; `experiment` has attributes of a default one."""
    outputs = [k for k, says in enumerate(variables.values(), 1) if says.startswith("output")]
    listed = "".join(f'<Unknown index="{k}"/>' for k in outputs)
    unknowns = f"<Outputs>{listed}</Outputs><InitialUnknowns>{listed}</InitialUnknowns>"
    text = (
        '<fmiModelDescription fmiVersion="2.0" modelName="test" guid="{test}">\n'
        '  <CoSimulation modelIdentifier="test"/>\n'
        f"{_UNITS_OF_FMU}{f'<DefaultExperiment {experiment}/>' if experiment else ''}"
        "  <ModelVariables>\n"
        + "".join(variable(n, says, k) for k, (n, says) in enumerate(variables.items()))
        + f"  </ModelVariables><ModelStructure>{unknowns if outputs else ''}</ModelStructure>\n"
        "</fmiModelDescription>\n"
    )
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("modelDescription.xml", text)
    return buffer.getvalue()


PLANT = fmu(u="input Real m/s", n="input Integer", k="parameter Real m/s", y="output Real m/s",
            warm="parameter Real K", gear="parameter Enumeration", on="parameter Boolean",
            name="parameter String", count="parameter Integer", z="output Real", v="input Real",
            slow="input Real mm/s", inner="local Real", m="output Integer")  # fmt: skip
"""An FMU with a variable of every kind."""

KINDS = {
    "u": "input", "n": "input", "k": "parameter", "y": "output", "warm": "parameter",
    "gear": "parameter", "on": "parameter", "name": "parameter", "count": "parameter",
    "z": "output", "v": "input", "slow": "input", "inner": "local", "m": "output",
}  # fmt: skip


def connectors(*names: str) -> str:
    """Connectors of systems or components; `u`, or `speed:input:Real km/h`."""
    lines = []
    for each in names:
        name, _, rest = each.partition(":")
        kind, _, type_ = rest.partition(":")
        word, _, unit = type_.partition(" ")
        said = f' unit="{unit}"' if unit else ""
        inside = f"<ssc:{word}{said}/>" if word else ""
        lines.append(
            f'<ssd:Connector name="{name}" kind="{kind or KINDS[name]}">{inside}</ssd:Connector>'
        )
    return f"<ssd:Connectors>{''.join(lines)}</ssd:Connectors>" if lines else ""


def component(name: str, *ports: str, source: str = "resources/plant.fmu", inside: str = "") -> str:
    """A component."""
    return (
        f'<ssd:Component name="{name}" source="{source}">'
        f"{connectors(*ports)}{inside}</ssd:Component>\n"
    )


def link(start: str, end: str, inside: str = "", more: str = "") -> str:
    """A connection of `element.connector`, or `.connector` of the system."""
    ends = []
    for which, text in (("start", start), ("end", end)):
        element, _, connector = text.rpartition(".")
        said = f'{which}Element="{element}" ' if element else ""
        ends.append(f'{said}{which}Connector="{connector}"')
    return f"<ssd:Connection {' '.join(ends)} {more}>{inside}</ssd:Connection>\n"


def system(name: str, *elements: str, ports: str = "", values: str = "", links: str = "") -> str:
    """A system; `values` are parameter bindings."""
    bindings = f"<ssd:ParameterBindings>{values}</ssd:ParameterBindings>" if values else ""
    connections = f"<ssd:Connections>\n{links}</ssd:Connections>" if links else ""
    return (
        f'<ssd:System name="{name}">{ports}{bindings}<ssd:Elements>\n{"".join(elements)}'
        f"</ssd:Elements>{connections}</ssd:System>\n"
    )


def values(*parameters: str, mapping: str = "", more: str = "", units: str = "") -> str:
    """A binding with parameters in place; `k:Real:3`, `k:Real:3:km/h`."""
    lines = []
    for each in parameters:
        name, type_, value, *unit = each.split(":")
        said = f' unit="{unit[0]}"' if unit else ""
        lines.append(
            f'<ssv:Parameter name="{name}"><ssv:{type_} value="{value}"{said}/></ssv:Parameter>\n'
        )
    mapped = (
        f'<ssd:ParameterMapping><ssm:ParameterMapping version="1.0">{mapping}'
        "</ssm:ParameterMapping></ssd:ParameterMapping>"
        if mapping
        else ""
    )
    return (
        f"<ssd:ParameterBinding {more}><ssd:ParameterValues>"
        f'<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>\n{"".join(lines)}'
        f"</ssv:Parameters>{units.replace('ssd:', 'ssv:')}</ssv:ParameterSet>"
        f"</ssd:ParameterValues>{mapped}</ssd:ParameterBinding>"
    )


def description(content: str, version: str = "1.0", name: str = "test", rest: str = UNITS) -> str:
    """A description with a system."""
    return (
        f'<ssd:SystemStructureDescription {SPACES} version="{version}" name="{name}">\n'
        f'{content}{rest}  <ssd:DefaultExperiment startTime="0" stopTime="2"/>\n'
        "</ssd:SystemStructureDescription>\n"
    )


def package(folder: Path, content: str, files: Mapping[str, str | bytes] | None = None) -> Path:
    """A package with a description and files; `resources/plant.fmu` is among them."""
    path = folder / "test.ssp"
    whole = {"SystemStructure.ssd": content, "resources/plant.fmu": PLANT, **(files or {})}
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in whole.items():
            archive.writestr(name, data)
    return path
