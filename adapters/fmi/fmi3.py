"""One instance of an FMI 3.0 co-simulation FMU."""

import ctypes
from collections.abc import Collection, Iterable, Mapping
from ctypes import c_bool, c_double, c_size_t, c_void_p
from typing import Any, Final

import fmpy
import fmpy.fmi3
import numpy as np
from typing_extensions import override

from adapters.fmi.block import Block
from adapters.fmi.description import FmuDescription
from adapters.fmi.errors import FmuError
from adapters.fmi.handle import FunctionNames
from adapters.fmi.instance import DISCARD, OK
from adapters.fmi.loaded import LoadedInstance
from adapters.fmi.messages import MessageLog
from adapters.fmi.unpacked import LoadedFmu
from adapters.fmi.variable import DTYPES, FmuVariable
from orchestrator.signal import Signal

_ARRAYS: Final = (c_void_p, c_void_p, c_size_t, c_void_p, c_size_t)
_BINARIES: Final = (c_void_p, c_void_p, c_size_t, c_void_p, c_void_p, c_size_t)
_STEP: Final = (c_void_p, c_double, c_double, c_bool, c_void_p, c_void_p, c_void_p, c_void_p)


class Fmi3Instance(LoadedInstance):
    """FMI 3.0.2, sections 2.2 and 4.2, without event mode, clocks and early return."""

    names = FunctionNames(
        prefix="fmi3", instantiate="fmi3InstantiateCoSimulation", state="FMUState"
    )
    dtypes = DTYPES

    def __init__(
        self, description: FmuDescription, name: str, log: MessageLog, *, may_restore: bool
    ) -> None:
        super().__init__(description, name, log, may_restore=may_restore)
        self._flags = [c_bool(), c_bool(), c_bool()]
        self._last_time = c_double()
        self._step_results = [*map(ctypes.byref, self._flags), ctypes.byref(self._last_time)]
        self._binary_outputs = self._binaries_among(None)
        categories = [c for c in description.log_categories if c.startswith("logStatus")]
        if categories and not log.is_verbose:
            names = (ctypes.c_char_p * len(categories))(*(c.encode() for c in categories))
            count = len(categories)
            self._fmu.call("fmi3SetDebugLogging", self._instance, True, count, names)  # noqa: FBT003

    @override
    def _instantiate(self, name: str, fmu: LoadedFmu) -> int | None:
        receive = self._log.receive

        def on_message(_: Any, status: int, category: bytes, message: bytes) -> None:
            receive(status, category, message)

        self._callback = fmpy.fmi3.fmi3LogMessageCallback(on_message)
        is_verbose = self._log.is_verbose
        resources = fmu.resources
        instance: int | None = fmu.call(
            "fmi3InstantiateCoSimulation",
            name.encode(),
            self._description.token.encode(),
            f"{resources}/".encode() if resources.is_dir() else None,
            False,  # noqa: FBT003  (visible)
            is_verbose,
            False,  # noqa: FBT003  (event mode)
            False,  # noqa: FBT003  (early return)
            None,
            0,
            None,
            self._callback,
            fmpy.fmi3.fmi3IntermediateUpdateCallback(),
        )
        return instance

    @override
    def configure(self, lengths: Mapping[str, int]) -> None:
        self._handle.call("fmi3EnterConfigurationMode")
        self.write({name: np.array(n, np.uint64) for name, n in lengths.items()})
        self._handle.call("fmi3ExitConfigurationMode")
        self._lengths.update(lengths)
        self._resize_blocks()

    @override
    def write(self, values: Mapping[str, Signal]) -> None:
        binaries = {name: value for name, value in values.items() if isinstance(value, bytes)}
        super().write(
            {n: v for n, v in values.items() if n not in binaries} if binaries else values
        )
        if binaries:
            self._write_binaries(binaries)

    @override
    def _write_block(self, block: Block, names: list[str]) -> None:
        function = self._fmu.function(f"fmi3Set{block.kind}", _ARRAYS)
        for references, count, address, size in block.calls(names):
            status = function(self._instance, references, count, address, size)
            if status != OK:
                self._guard.check(f"fmi3Set{block.kind} of {_listed(names)}", status)

    def _write_binaries(self, values: Mapping[str, bytes]) -> None:
        variables = self._description.variables
        count = len(values)
        references = (ctypes.c_uint32 * count)(*(variables[name].reference for name in values))
        sizes = (c_size_t * count)(*map(len, values.values()))
        pointers = (ctypes.c_char_p * count)(*values.values())
        status = self._fmu.function("fmi3SetBinary", _BINARIES)(
            self._instance, references, count, sizes, pointers, count
        )
        self._guard.check(f"fmi3SetBinary of {_listed(values)}", status)

    @override
    def _write_string(self, reference: Any, pointer: Any) -> None:
        self._handle.call("fmi3SetString", reference, 1, pointer, 1)

    @override
    def enter_initialisation(
        self, t: float, *, stop: float | None, tolerance: float | None
    ) -> None:
        self._handle.call(
            "fmi3EnterInitializationMode",
            tolerance is not None,
            tolerance or 0.0,
            t,
            stop is not None,
            stop or 0.0,
        )

    @override
    def step(self, t: float, h: float) -> None:
        self._log.recent.clear()
        function = self._fmu.function("fmi3DoStep", _STEP)
        self._last_time.value = t
        status = function(self._instance, t, h, not self._may_restore, *self._step_results)
        self.judge_step(status, t, h)

    @override
    def judge_step(self, status: int, t: float, h: float) -> None:
        if status == DISCARD:
            reached = f" (the last successful time is {self._last_time.value:.9g} s)"
            self._guard.refuse("fmi3DoStep", status, reached)
        if status > OK:
            self._guard.check("fmi3DoStep", status)
        _, is_over, is_early = self._flags
        if is_early.value:
            raise FmuError(
                f"fmi3DoStep returned early, at {self._last_time.value:.9g} s, although that was "
                "not allowed"
            )
        if is_over.value:
            raise FmuError(f"the FMU asks to end the simulation at {t + h:.9g} s")

    @override
    def _flag_addresses(self) -> tuple[int, ...]:
        return tuple(map(ctypes.addressof, self._flags))

    @override
    def _last_time_address(self) -> int:
        return ctypes.addressof(self._last_time)

    @override
    def _read_block(self, block: Block, elements: Any) -> None:
        function = self._fmu.function(f"fmi3Get{block.kind}", _ARRAYS)
        count = len(block.variables)
        status = function(self._instance, block.references, count, elements, block.size)
        if status != OK:
            self._guard.check(f"fmi3Get{block.kind}", status)

    @override
    def select(self, names: Collection[str] | None) -> None:
        super().select(names)
        self._binary_outputs = self._binaries_among(names)

    def _binaries_among(self, names: Collection[str] | None) -> list[FmuVariable]:
        return [
            v
            for v in self._description.of("output")
            if v.type == "Binary" and v.is_signal and (names is None or v.name in names)
        ]

    @override
    def read(self) -> dict[str, Signal]:
        found = super().read()
        if self._binary_outputs:
            found.update(self._read_binaries())
        return found

    def _read_binaries(self) -> dict[str, bytes]:
        count = len(self._binary_outputs)
        references = (ctypes.c_uint32 * count)(*(v.reference for v in self._binary_outputs))
        sizes, pointers = (c_size_t * count)(), (c_void_p * count)()
        status = self._fmu.function("fmi3GetBinary", _BINARIES)(
            self._instance, references, count, sizes, pointers, count
        )
        self._guard.check("fmi3GetBinary", status)
        return {  # copied at once: the FMU may reuse its memory at the next call
            variable.name: ctypes.string_at(pointer, size) if pointer and size else b""
            for variable, pointer, size in zip(self._binary_outputs, pointers, sizes, strict=True)
        }


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)
