"""An instance in a library that this process loaded: what FMI 2.0 and 3.0 have in common."""

import abc
import ctypes
import functools
import math
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from ctypes import c_void_p
from dataclasses import replace
from typing import Any, ClassVar, NoReturn

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from adapters.fmi.block import Block, address_of, blocks, shape_of
from adapters.fmi.description import FmuDescription
from adapters.fmi.handle import FunctionNames, Handle
from adapters.fmi.instance import DISCARD, FmuInstance
from adapters.fmi.kind import Kind
from adapters.fmi.messages import MessageLog
from adapters.fmi.parcels import Parcel, packed, parcels
from adapters.fmi.rates import told_rates
from adapters.fmi.starts import startable
from adapters.fmi.unpacked import LoadedFmu
from orchestrator.native import NativeKind, NativeOwner, NativeUnit, NativeVariable
from orchestrator.signal import Array, Connector, Signal


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
        names = self.names
        made = names.instantiate.replace(Kind.CO_SIMULATION.element, description.kind.element)
        names = replace(names, instantiate=made)
        self._handle = Handle(LoadedFmu(description, name), log, names, instantiate)
        self._fmu, self._guard = self._handle.fmu, self._handle.guard
        self._instance = self._handle.address
        self._blocks = [
            *blocks(description.of("structuralParameter", "parameter"), self.dtypes),
            *blocks(description.of("input"), self.dtypes),
            *blocks((v for v in startable(description) if v.causality != "input"), self.dtypes),
        ]
        self._block_of = {v.name: block for block in self._blocks for v in block.variables}
        outputs = [v for v in description.of("output") if not v.is_clocked]
        self._output_blocks = blocks(outputs, self.dtypes)
        self._output_parcels = parcels(outputs)
        self._selected: frozenset[str] | None = None
        self._has_bytes = any(v.is_bytes for v in description.variables.values())
        self._variable_of = {e: v for v in description.variables.values() for e in v.elements}
        self._resize_blocks()

    @property
    def handle(self) -> Handle:
        """The instance, for functions that not every FMU has."""
        return self._handle

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
    def _write_parcel(self, parcel: Parcel, elements: Sequence[bytes]) -> None:
        """Set the variables of a parcel."""

    @abc.abstractmethod
    def _read_parcel(self, parcel: Parcel) -> list[bytes]:
        """Get the elements of a parcel."""

    def _resize_blocks(self) -> None:
        for block in (*self._blocks, *self._output_blocks):
            block.resize(self._lengths)
        for block in self._blocks:
            block.allocate()

    @override
    def write(self, values: Mapping[str, Signal]) -> None:
        numbers = self._write_bytes(values) if self._has_bytes else values
        groups: defaultdict[Block, list[str]] = defaultdict(list)
        for name, value in numbers.items():
            block = self._block_of[name]
            block.views[name][...] = value
            groups[block].append(name)
        for block, names in groups.items():
            self._write_block(block, names)

    def _write_bytes(self, values: Mapping[str, Signal]) -> Mapping[str, Signal]:
        """Set texts and Binaries; the rest of `values`."""
        moved, numbers = packed(self._variable_of, values)
        for parcel, elements in moved:
            self._write_parcel(parcel, elements)
        return numbers

    @override
    def select(self, names: Collection[str] | None) -> None:
        self._selected = None if names is None else frozenset(names)
        chosen = [
            v
            for v in self._description.of("output")
            if not v.is_clocked and any(map(self._is_selected, v.elements))
        ]
        self._output_blocks = blocks(chosen, self.dtypes)
        self._output_parcels = parcels(chosen)
        for block in self._output_blocks:
            block.resize(self._lengths)

    def _is_selected(self, name: str) -> bool:
        """Whether anybody looks at the output of this name."""
        return self._selected is None or name in self._selected

    @override
    def read(self) -> dict[str, Signal]:
        found: dict[str, Signal] = {}
        for block in self._output_blocks:
            found.update(self._read_elements(block))
        for parcel in self._output_parcels:
            texts = zip(parcel.names, self._read_parcel(parcel), strict=True)
            found.update({name: text for name, text in texts if self._is_selected(name)})
        return found

    def _read_elements(self, block: Block) -> dict[str, Array]:
        """The values of a block, by variable."""
        elements = block.fresh()
        self._read_block(block, address_of(elements))
        return block.split(elements != 0 if block.kind == "Boolean" else elements)

    @override
    def native(self, connectors: Mapping[str, Connector], owner: NativeOwner) -> NativeUnit | None:
        variables = {name: self._variable_of[name] for name in connectors}
        if any(v.is_bytes and v.axes for v in variables.values()):
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
    def discarded(self, reached: float, hint: str) -> NoReturn:
        remark = f" (the last successful time is {reached:.9g} s)"
        self._guard.refuse(f"{self.names.prefix}DoStep", DISCARD, remark, hint)

    @override
    def getting_failed(self, type_: str, status: int) -> None:
        self._guard.check(f"{self.names.prefix}Get{type_}", status)

    @override
    def write_text(self, values: Mapping[str, Sequence[str]]) -> None:
        for name, texts in values.items():
            reference = (ctypes.c_uint32 * 1)(self._description.variables[name].reference)
            parcel = Parcel("String", (name,) * len(texts), reference)
            self._write_parcel(parcel, [text.encode() for text in texts])

    @property
    @override
    def uses_events(self) -> bool:
        return False

    @override
    def told_rates(self) -> dict[str, Signal]:
        return told_rates(self._handle, self._description, self._lengths)

    @override
    def begin_step(self) -> None:
        pass

    @override
    def write_jumps(self, values: Mapping[str, Signal], t: float) -> bool:
        self.write(values)
        return False

    @override
    def exit_initialisation(self, t: float) -> bool:
        self._handle.exit_initialisation()
        return False

    @property
    @override
    def lengths(self) -> Mapping[str, int]:
        return self._lengths

    @override
    def directional(self, unknowns: Sequence[str], knowns: Sequence[str], seed: Array) -> Array:
        found = np.zeros(self._count(unknowns))
        self._differentiate(self.names.directional, unknowns, knowns, (seed, found))
        return found

    @override
    def adjoint(self, unknowns: Sequence[str], knowns: Sequence[str], seed: Array) -> Array:
        found = np.zeros(self._count(knowns))
        self._differentiate("fmi3GetAdjointDerivative", unknowns, knowns, (seed, found))
        return found

    def _count(self, names: Sequence[str]) -> int:
        variables = self._description.variables
        return sum(math.prod(shape_of(variables[name], self._lengths)) for name in names)

    def _differentiate(
        self,
        function: str,
        unknowns: Sequence[str],
        knowns: Sequence[str],
        values: tuple[Array, Array],
    ) -> None:
        """Call a function for derivatives with `values`, its seed and what it fills in."""
        arguments: list[Any] = []
        for names in (unknowns, knowns):
            references = [self._description.variables[name].reference for name in names]
            arguments += [(ctypes.c_uint32 * len(names))(*references), len(names)]
        for each in values:
            arguments += [c_void_p(each.ctypes.data), each.size]
        self._call_derivative(function, arguments)

    @abc.abstractmethod
    def _call_derivative(self, function: str, arguments: Sequence[Any]) -> None:
        """Call it with the unknowns, the knowns, the seed and the result, each with its size."""

    @override
    def save(self) -> int:
        return self._handle.save()

    @override
    def restore(self, state: int, lengths: Mapping[str, int] | None) -> None:
        self._handle.restore(state)
        if lengths is not None and lengths != self._lengths:
            self._lengths = dict(lengths)
            self._resize_blocks()

    @override
    def serialize(self, state: int) -> bytes:
        return self._handle.serialize(state)

    @override
    def deserialize(self, content: bytes) -> int:
        return self._handle.deserialize(content)

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
        "String": NativeKind.TEXT,
    }
    return kinds.get(type_, NativeKind.PLAIN)
