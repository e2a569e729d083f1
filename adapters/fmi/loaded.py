"""An instance in a library that this process loaded: what FMI 2.0 and 3.0 have in common."""

import abc
import ctypes
import functools
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from typing import Any, ClassVar

import numpy.typing as npt
from typing_extensions import override

from adapters.fmi.block import Block, address_of, blocks, shape_of
from adapters.fmi.description import FmuDescription
from adapters.fmi.handle import FunctionNames, Handle
from adapters.fmi.instance import FmuInstance
from adapters.fmi.messages import MessageLog
from adapters.fmi.starts import startable
from adapters.fmi.unpacked import LoadedFmu
from orchestrator.native import NativeKind, NativeOwner, NativeUnit, NativeVariable
from orchestrator.signal import Connector, Signal


class LoadedInstance(FmuInstance):
    """An instance whose functions are called here.

    Args:
        description: of the FMU.
        name: of the instance.
        log: receives what the FMU says.
        may_restore: whether a step may be followed by a return to a state before it.
    """

    names: ClassVar[FunctionNames]
    """Those of the functions of the FMI version."""
    dtypes: ClassVar[Mapping[str, npt.DTypeLike]]
    """The types of its variables."""

    def __init__(
        self, description: FmuDescription, name: str, log: MessageLog, *, may_restore: bool
    ) -> None:
        self._description = description
        self._log = log
        self._may_restore = may_restore
        self._lengths = {
            v.name: int(v.start[0]) for v in description.of("structuralParameter") if v.start
        }
        instantiate = functools.partial(self._instantiate, name)
        self._handle = Handle(LoadedFmu(description, name), log, self.names, instantiate)
        self._fmu, self._guard = self._handle.fmu, self._handle.guard
        self._instance = self._handle.address
        self._blocks = [
            *blocks(description.of("structuralParameter", "parameter"), self.dtypes),
            *blocks(description.of("input"), self.dtypes),
            *blocks((v for v in startable(description) if v.causality != "input"), self.dtypes),
        ]
        self._block_of = {v.name: block for block in self._blocks for v in block.variables}
        self._output_blocks = blocks(description.of("output"), self.dtypes)
        self._resize_blocks()

    @abc.abstractmethod
    def _instantiate(self, name: str, fmu: LoadedFmu) -> int | None:
        """The address of a new instance called `name`, if there is one."""

    @abc.abstractmethod
    def _write_block(self, block: Block, names: list[str]) -> None:
        """Set the variables `names` to what stands in their block."""

    @abc.abstractmethod
    def _read_block(self, block: Block, elements: Any) -> None:
        """Get the values of a block into the memory at the address `elements`."""

    @abc.abstractmethod
    def _write_string(self, reference: Any, pointer: Any) -> None:
        """Set one variable, by pointers to its reference and to its text."""

    def _resize_blocks(self) -> None:
        for block in (*self._blocks, *self._output_blocks):
            block.resize(self._lengths)
        for block in self._blocks:
            block.allocate()

    @override
    def write(self, values: Mapping[str, Signal]) -> None:
        groups: defaultdict[Block, list[str]] = defaultdict(list)
        for name, value in values.items():
            block = self._block_of[name]
            block.views[name][...] = value
            groups[block].append(name)
        for block, names in groups.items():
            self._write_block(block, names)

    @override
    def select(self, names: Collection[str] | None) -> None:
        chosen = (v for v in self._description.of("output") if names is None or v.name in names)
        self._output_blocks = blocks(chosen, self.dtypes)
        for block in self._output_blocks:
            block.resize(self._lengths)

    @override
    def read(self) -> dict[str, Signal]:
        found: dict[str, Signal] = {}
        for block in self._output_blocks:
            elements = block.fresh()
            self._read_block(block, address_of(elements))
            found.update(block.split(elements != 0 if block.kind == "Boolean" else elements))
        return found

    @override
    def native(self, connectors: Mapping[str, Connector], owner: NativeOwner) -> NativeUnit | None:
        variables = {name: self._description.variables[name] for name in connectors}
        if any(v.type == "Binary" and v.axes for v in variables.values()):
            return None
        types = {v.type for v in variables.values()}
        version = self._description.version
        return NativeUnit(
            version=version,
            instance=self._instance,
            step=self._address_of(f"fmi{version}DoStep"),
            keeps_state=not self._may_restore,
            flags=self._flag_addresses(),
            last_time=self._last_time_address(),
            setters={type_: self._address_of(f"fmi{version}Set{type_}") for type_ in types},
            getters={type_: self._address_of(f"fmi{version}Get{type_}") for type_ in types},
            variables={
                name: NativeVariable(
                    type=v.type,
                    kind=_kind(v.type, version),
                    reference=v.reference,
                    shape=shape_of(v, self._lengths),
                )
                for name, v in variables.items()
            },
            owner=owner,
        )

    def _address_of(self, function: str) -> int:
        return self._fmu.address_of(function)

    def _flag_addresses(self) -> tuple[int, ...]:
        """FMI 3.0: where a step says what came."""
        return (0, 0, 0)

    def _last_time_address(self) -> int:
        """FMI 3.0: where a step says how far it came."""
        return 0

    @override
    def count_calls(self, address: int | None) -> None:
        self._log.count_calls(address)

    @override
    def setting_failed(self, type_: str, names: Sequence[str], status: int) -> None:
        listed = ", ".join(f"`{name}`" for name in names)
        self._guard.check(f"{self.names.prefix}Set{type_} of {listed}", status)

    @override
    def getting_failed(self, type_: str, status: int) -> None:
        self._guard.check(f"{self.names.prefix}Get{type_}", status)

    @override
    def write_text(self, values: Mapping[str, str]) -> None:
        for name, text in values.items():
            reference = ctypes.c_uint32(self._description.variables[name].reference)
            pointer = (ctypes.c_char_p * 1)(text.encode())
            self._write_string(ctypes.byref(reference), pointer)

    @override
    def exit_initialisation(self) -> None:
        self._handle.exit_initialisation()

    @override
    def save(self) -> int:
        return self._handle.save()

    @override
    def restore(self, state: int, lengths: Mapping[str, int]) -> None:
        self._handle.restore(state)
        if lengths != self._lengths:
            self._lengths = dict(lengths)
            self._resize_blocks()

    @override
    def forget(self, state: int) -> None:
        self._handle.forget(state)

    @override
    def free(self) -> None:
        self._handle.free()


def _kind(type_: str, version: int) -> NativeKind:
    if type_ == "Boolean":
        return NativeKind.BOOLEAN32 if version == 2 else NativeKind.BOOLEAN8
    kinds = {
        "Real": NativeKind.FLOAT64,
        "Float64": NativeKind.FLOAT64,
        "Float32": NativeKind.FLOAT32,
        "Binary": NativeKind.BINARY,
    }
    return kinds.get(type_, NativeKind.PLAIN)
