"""FMUs that cost next to nothing by themselves, compiled from plain C when they are needed."""

import functools
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final
from xml.etree import ElementTree as ET

import fmpy

from adapters.fmi.unpacked import host_folder
from fmus.native.targets import compile_library, select_targets
from fmus.native.unit import fmi_headers

HERE: Final = Path(__file__).parent
FACTOR: Final = 0.999
"""What a Gain multiplies its input by."""

TYPES: Final[Mapping[int, tuple[str, ...]]] = MappingProxyType(
    {
        2: ("Real", "Integer", "Boolean"),
        3: ("Float32", "Float64", "Int32", "Int64", "UInt8", "Boolean"),
    }
)
"""The types that the C sources know, by version of FMI."""


@dataclass(frozen=True, slots=True)
class Variable:
    """An input or output.

    Attributes:
        name: of the variable.
        type: the FMI type.
        reference: its value reference.
        is_input: whether it is an input.
    """

    name: str
    type: str
    reference: int
    is_input: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """What is compiled.

    Attributes:
        name: of the FMU.
        version: of FMI, 2 or 3.
        counts: outputs by type; as many inputs, except of a source.
        is_source: whether its outputs follow the number of its steps; otherwise its inputs.
        factor: of inputs of the types Real and Float64.
        shape: of every variable; scalars in FMI 2.0.
    """

    name: str
    version: int
    counts: tuple[tuple[str, int], ...]
    is_source: bool = False
    factor: float = 1.0
    shape: tuple[int, ...] = ()

    @property
    def token(self) -> str:
        """What the model description and the library must agree on."""
        return f"{{importer-{self.name}-{self.version}}}"

    @property
    def length(self) -> int:
        """Elements of a variable."""
        length = 1
        for n in self.shape:
            length *= n
        return length

    def variables(self) -> Iterator[Variable]:
        """All variables, by type and inputs first; a source has no inputs."""
        for type_, offset in self._offsets().items():
            count = dict(self.counts).get(type_, 0)
            for is_input in (True, False):
                way = "in" if is_input else "out"
                first = offset if is_input else offset + count
                for k in range(0 if is_input and self.is_source else count):
                    yield Variable(f"{type_}_{way}_{k + 1}", type_, first + k, is_input)

    def of(self, type_: str, *, inputs: bool) -> list[Variable]:
        """The inputs or outputs of a type."""
        return [v for v in self.variables() if v.type == type_ and v.is_input is inputs]

    def _offsets(self) -> Mapping[str, int]:
        """The first value reference of each type: 100 apart in FMI 3.0, where they are unique."""
        apart = 0 if self.version == 2 else 100
        return {type_: apart * k for k, type_ in enumerate(TYPES[self.version])}

    def header(self) -> str:
        """`model.h`."""
        counts = dict(self.counts)
        names = {t: t.upper() if self.version == 2 else t for t in TYPES[self.version]}
        lines = [
            f"#define IS_SOURCE {int(self.is_source)}",
            f"#define FACTOR {self.factor!r}",
            f"#define LENGTH {self.length}",
            f'#define TOKEN "{self.token}"',
            *(f"#define N_{name} {counts.get(t, 0)}" for t, name in names.items()),
            *(f"#define OFFSET_{names[t]} {offset}" for t, offset in self._offsets().items()),
        ]
        return "\n".join(lines) + "\n"

    def description(self) -> bytes:
        """`modelDescription.xml`: outputs depend on no input at the same time."""
        return ET.tostring(_described2(self) if self.version == 2 else _described3(self))


def _described2(model: Model) -> ET.Element:
    root = ET.Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=model.name, guid=model.token,
        variableNamingConvention="flat",
    )  # fmt: skip
    can = {"canHandleVariableCommunicationStepSize": "true"}
    ET.SubElement(root, "CoSimulation", {"modelIdentifier": model.name, **can})
    listed = ET.SubElement(root, "ModelVariables")
    structure = ET.SubElement(root, "ModelStructure")
    outputs = ET.SubElement(structure, "Outputs")
    unknowns = ET.SubElement(structure, "InitialUnknowns")
    for index, each in enumerate(model.variables(), start=1):
        about = {"name": each.name, "valueReference": str(each.reference), **_about(each)}
        variable = ET.SubElement(listed, "ScalarVariable", about)
        start = {"start": "false" if each.type == "Boolean" else "0"} if each.is_input else {}
        ET.SubElement(variable, each.type, start)
        if not each.is_input:
            ET.SubElement(outputs, "Unknown", index=str(index), dependencies="")
            ET.SubElement(unknowns, "Unknown", index=str(index), dependencies="")
    return root


def _described3(model: Model) -> ET.Element:
    root = ET.Element(
        "fmiModelDescription", fmiVersion="3.0", modelName=model.name,
        instantiationToken=model.token,
    )  # fmt: skip
    can = {"canHandleVariableCommunicationStepSize": "true"}
    ET.SubElement(root, "CoSimulation", {"modelIdentifier": model.name, **can})
    listed = ET.SubElement(root, "ModelVariables")
    structure = ET.SubElement(root, "ModelStructure")
    time = {"name": "time", "valueReference": "999", "causality": "independent"}
    ET.SubElement(listed, "Float64", {**time, "variability": "continuous"})
    for each in model.variables():
        about = {"name": each.name, "valueReference": str(each.reference), **_about(each)}
        if each.is_input:
            start = "false" if each.type == "Boolean" else "0"
            about["start"] = " ".join([start] * model.length)
        variable = ET.SubElement(listed, each.type, about)
        for n in model.shape:
            ET.SubElement(variable, "Dimension", start=str(n))
    for kind in ("Output", "InitialUnknown"):
        for each in model.variables():
            if not each.is_input:
                reference = str(each.reference)
                ET.SubElement(structure, kind, valueReference=reference, dependencies="")
    return root


def _about(variable: Variable) -> dict[str, str]:
    discrete = variable.type not in {"Real", "Float32", "Float64"}
    found = {
        "causality": "input" if variable.is_input else "output",
        "variability": "discrete" if discrete else "continuous",
    }
    return found if variable.is_input else {**found, "initial": "calculated"}


@functools.cache
def _folder() -> tempfile.TemporaryDirectory[str]:
    """Where FMUs and libraries are until this process ends."""
    return tempfile.TemporaryDirectory(prefix="nlosim-importer-")


@functools.cache
def fmu(model: Model) -> Path:
    """The FMU, compiled by Zig for this machine.

    Raises:
        CompilerError: there is no compiler.
    """
    folder = Path(tempfile.mkdtemp(prefix=f"{model.name}-{model.version}-", dir=_folder().name))
    (folder / "model.h").write_text(model.header(), encoding="utf-8")
    library = folder / f"{model.name}{fmpy.sharedLibraryExtension}"
    compile_library(
        select_targets(["host"])[0],
        sources=[HERE / f"fmi{model.version}.c"],
        include=[folder],
        system_include=fmi_headers(),
        library=library,
    )
    path = folder / f"{model.name}.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", model.description())
        archive.write(library, f"binaries/{host_folder(model.version)}/{library.name}")
    return path


@functools.cache
def floor_library() -> Path:
    """`floor.c`, compiled.

    Raises:
        CompilerError: there is no compiler.
    """
    library = Path(_folder().name) / f"floor{fmpy.sharedLibraryExtension}"
    compile_library(
        select_targets(["host"])[0],
        sources=[HERE / "floor.c"],
        include=[HERE],
        system_include=fmi_headers(),
        library=library,
    )
    return library
