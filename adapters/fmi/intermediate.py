"""What an FMU shows while it steps (FMI 3.0.2, intermediate update): logged, if it is asked for."""

from collections.abc import Callable, Mapping, Sequence
from ctypes import c_uint32
from typing import Any, TypeAlias

import fmpy.fmi3
import numpy.typing as npt

from adapters.fmi.block import Block, address_of, blocks
from adapters.fmi.errors import FmuError
from adapters.fmi.messages import MessageLog
from adapters.fmi.variable import FmuVariable

ReadBlock: TypeAlias = Callable[[Block, Any], None]
"""Gets the values of a block into the memory at an address."""


class IntermediateUpdates:
    """The callback of one instance: it logs values, and lets the FMU step on.

    Args:
        variables: what is logged; nothing: the FMU gets no callback.
        dtypes: element types, by FMI type.
        log: of the instance.
        read: gets values.

    Attributes:
        callback: for the FMU, which keeps its address.
        count: of the variables.
        references: their value references.
    """

    def __init__(
        self,
        variables: Sequence[FmuVariable],
        dtypes: Mapping[str, npt.DTypeLike],
        log: MessageLog,
        read: ReadBlock,
    ) -> None:
        self._blocks = blocks(variables, dtypes)
        self._log = log
        self._read = read
        self.count = len(variables)
        self.references = (c_uint32 * self.count)(*(v.reference for v in variables))
        kind = fmpy.fmi3.fmi3IntermediateUpdateCallback
        self.callback: Any = kind(self._update) if variables else kind()

    def resize(self, lengths: Mapping[str, int]) -> None:
        """Let structural parameters have the values `lengths`."""
        for block in self._blocks:
            block.resize(lengths)

    def _update(  # noqa: PLR0917  (FMI has so many)
        self,
        environment: Any,
        time: float,
        is_set_requested: bool,  # noqa: FBT001
        may_get: bool,  # noqa: FBT001
        is_step_finished: bool,  # noqa: FBT001
        can_return_early: bool,  # noqa: FBT001
        wants_early: Any,
        early_time: Any,
    ) -> None:
        """Called by the FMU, so it must not raise. No input changes within a step."""
        del environment, is_set_requested, is_step_finished, can_return_early
        wants_early[0], early_time[0] = False, time
        if may_get:
            self._log.note(self._shown(time))

    def _shown(self, time: float) -> str:
        try:
            values = {name: value for block in self._blocks for name, value in self._got(block)}
        except FmuError as error:
            return f"within a step, at {time:.9g} s: {error}"
        shown = ", ".join(f"{name} = {value}" for name, value in values.items())
        return f"within a step, at {time:.9g} s: {shown}"

    def _got(self, block: Block) -> list[tuple[str, str]]:
        elements = block.fresh()
        self._read(block, address_of(elements))
        if block.kind == "Boolean":
            elements = elements != 0
        return [(name, str(value.tolist())) for name, value in block.split(elements).items()]
