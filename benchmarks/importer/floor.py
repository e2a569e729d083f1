"""The C loop that does nothing but what must be done."""

import ctypes
from dataclasses import dataclass
from time import process_time_ns
from typing import Any, ClassVar

import numpy as np
from typing_extensions import override

from benchmarks.benchmark import Case, Measurement
from benchmarks.importer.chain import STEP_NS, Chain
from benchmarks.importer.instances import Instance, instances
from benchmarks.importer.model import floor_library
from orchestrator.signal import Array


class _Group(ctypes.Structure):
    _fields_: ClassVar = [
        *((name, ctypes.c_void_p) for name in ("set", "get", "input", "output", "source", "to")),
        ("references", ctypes.c_size_t),
        ("count", ctypes.c_size_t),
        ("size", ctypes.c_size_t),
        ("record", ctypes.c_void_p),
    ]


class _Member(ctypes.Structure):
    _fields_: ClassVar = [
        ("instance", ctypes.c_void_p),
        ("step", ctypes.c_void_p),
        ("group", ctypes.POINTER(_Group)),
        ("groups", ctypes.c_size_t),
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorRun(Case):
    """Gauss-Seidel in the order of the chain; every output at every step is stored in an array.

    Attributes:
        chain: of FMUs.
        steps: communication steps.
        is_recorded: whether anything is stored; otherwise the last FMU is not asked for outputs.
        is_shared: whether all instances use one library; each has its own in our importer.
    """

    chain: Chain
    steps: int
    is_recorded: bool = True
    is_shared: bool = True

    @override
    def measure(self) -> Measurement:
        """Run once.

        Returns:
            `step_us`: CPU time of a step of one FMU.
        """
        library = ctypes.CDLL(str(floor_library()))
        library.floor_run.argtypes = (
            ctypes.POINTER(_Member), ctypes.c_size_t, ctypes.c_int, ctypes.c_int64, ctypes.c_double
        )  # fmt: skip
        keep: list[Any] = []
        with instances(self.chain, is_shared=self.is_shared) as made:
            steps = self.steps if self.is_recorded else 0
            members = [_member(each, self.chain.version, steps, keep) for each in made]
            if not self.is_recorded:
                members[-1].group[0].get = None
            table = (_Member * len(members))(*members)
            before = process_time_ns()
            failed = library.floor_run(
                table, len(members), self.chain.version, self.steps, STEP_NS * 1e-9
            )
            spent = process_time_ns() - before
            if failed or self.is_recorded:
                self.chain.check("the C loop", {} if failed else made[-1].last(), self.steps)
        return {"step_us": spent * 1e-3 / (self.steps * self.chain.length)}


def _member(instance: Instance, version: int, steps: int, keep: list[Any]) -> _Member:
    def function(name: str) -> int | None:
        found = instance.slave.dll[f"fmi{version}{name}"]
        return ctypes.cast(found, ctypes.c_void_p).value

    groups = (_Group * len(instance.groups))()
    for table, group in zip(groups, instance.groups, strict=True):
        size = ctypes.sizeof(group.elements)
        record: Array = np.ones(steps * size, np.uint8)  # touched: pages are there already
        table.references = len(group.outputs)
        table.set, table.get = function(f"Set{group.type}"), function(f"Get{group.type}")
        table.input, table.output = ctypes.addressof(group.inputs), ctypes.addressof(group.outputs)
        table.source = None if group.source is None else ctypes.addressof(group.source)
        table.to, table.count = ctypes.addressof(group.elements), len(group.elements)
        table.size, table.record = size, record.ctypes.data if steps else None
        keep += [record, groups]
    component = instance.slave.component
    address = ctypes.cast(component, ctypes.c_void_p).value
    return _Member(address, function("DoStep"), groups, len(groups))
