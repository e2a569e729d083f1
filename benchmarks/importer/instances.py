"""Running instances of a chain, made by FMPy: what it steps, and what the C loop steps."""

import ctypes
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from benchmarks.importer.chain import Chain, Last
from benchmarks.importer.model import Model, Variable, fmu

_ELEMENTS: Final = {
    "Real": ctypes.c_double, "Integer": ctypes.c_int32, "Float32": ctypes.c_float,
    "Float64": ctypes.c_double, "Int32": ctypes.c_int32, "Int64": ctypes.c_int64,
    "UInt8": ctypes.c_uint8,
}  # fmt: skip


@dataclass(slots=True, eq=False)
class Group:
    """The variables of one type of one instance.

    Attributes:
        type: the FMI type.
        inputs, outputs: value references; `inputs` is empty if nobody is before.
        source: the elements that the inputs are set to: those of the instance before.
        elements: the outputs.
        names: of the outputs.
    """

    type: str
    inputs: Any
    outputs: Any
    source: Any
    elements: Any
    names: list[str]


@dataclass(slots=True, eq=False)
class Instance:
    """One FMU of the chain.

    Attributes:
        slave: FMPy's object.
        groups: its variables.
    """

    slave: Any
    groups: list[Group]

    def last(self) -> Last:
        """The elements of its outputs."""
        return {
            name: value
            for group in self.groups
            for name, value in zip(group.names, group.elements, strict=True)
        }


@contextmanager
def instances(chain: Chain, *, is_shared: bool = True) -> Iterator[list[Instance]]:
    """The FMUs of `chain`, initialised at 0 and connected by the memory of their elements.

    Args:
        chain: of FMUs.
        is_shared: whether all instances of a model use one library; otherwise each has a copy.
    """
    made: list[Instance] = []
    with tempfile.TemporaryDirectory() as folder:
        try:
            for name, model in chain.members:
                place = Path(folder) / (model.name if is_shared else name)
                if not place.exists():
                    fmpy.extract(str(fmu(model)), str(place))
                slave = _instantiated(model, name, str(place))
                before = made[-1] if made else None
                made.append(Instance(slave, _groups(model, before)))
            yield made
        finally:
            for each in made:
                each.slave.terminate()
                each.slave.freeInstance()


def _instantiated(model: Model, name: str, place: str) -> Any:
    kind = FMU2Slave if model.version == 2 else FMU3Slave
    slave = kind(
        guid=model.token, unzipDirectory=place, modelIdentifier=model.name, instanceName=name
    )
    slave.instantiate()
    if model.version == 2:
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
    else:
        slave.enterInitializationMode(startTime=0.0)
    slave.exitInitializationMode()
    return slave


def _groups(model: Model, before: Instance | None) -> list[Group]:
    found = []
    for k, (type_, _) in enumerate(model.counts):
        outputs, inputs = model.of(type_, inputs=False), model.of(type_, inputs=True)
        found.append(
            Group(
                type=type_,
                inputs=_references(inputs),
                outputs=_references(outputs),
                source=None if before is None else before.groups[k].elements,
                elements=(_element(model, type_) * (len(outputs) * model.length))(),
                names=[each.name for each in outputs],
            )
        )
    return found


def _references(variables: list[Variable]) -> Any:
    return (ctypes.c_uint32 * len(variables))(*(each.reference for each in variables))


def _element(model: Model, type_: str) -> Any:
    if type_ == "Boolean":
        return ctypes.c_int32 if model.version == 2 else ctypes.c_bool
    return _ELEMENTS[type_]
