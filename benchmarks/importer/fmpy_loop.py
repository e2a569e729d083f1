"""FMPy: its calls in a loop of Python, Gauss-Seidel in the order of the chain."""

import ctypes
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from time import process_time_ns
from typing import Any

from typing_extensions import override

from benchmarks.benchmark import Case, Measurement
from benchmarks.importer.chain import STEP_NS, Chain
from benchmarks.importer.instances import Instance, instances

_H = STEP_NS * 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class FmpyRun(Case):
    """Every output at every step is kept in a list.

    Attributes:
        chain: of FMUs.
        steps: communication steps.
        prepared: call FMPy's `fmi2GetReal` and the like with arrays that are there already, and
            keep their bytes: what one sets is what the one before got, without a copy. Otherwise
            call `getReal` and the like, and keep the values.
    """

    chain: Chain
    steps: int
    prepared: bool

    @override
    def measure(self) -> Measurement:
        """Run once.

        Returns:
            `step_us`: CPU time of a step of one FMU.
        """
        with instances(self.chain) as members:
            run = _run_prepared if self.prepared else _run_methods
            spent = run(members, self.chain.version, self.steps)
            self.chain.check("FMPy", members[-1].last(), self.steps)
        return {"step_us": spent * 1e-3 / (self.steps * self.chain.length)}


def _run_prepared(members: list[Instance], version: int, steps: int) -> int:
    """CPU time [ns]."""
    plan = []
    keep: Callable[[bytes], None]
    records: list[list[bytes]] = []
    for member in members:
        sets, gets = [], []
        for group in member.groups:
            records.append([])
            keep = records[-1].append
            n = len(group.outputs)
            rest = (n,) if version == 3 else ()
            if group.source is not None:
                function = getattr(member.slave, f"fmi{version}Set{group.type}")
                component = member.slave.component
                sets.append(partial(function, component, group.inputs, n, group.source, *rest))
            function = getattr(member.slave, f"fmi{version}Get{group.type}")
            component = member.slave.component
            got = partial(function, component, group.outputs, n, group.elements, *rest)
            gets.append((got, keep, group.elements))
        plan.append((sets, _step(member, version), gets))
    before = process_time_ns()
    for k in range(steps):
        t = k * _H
        for sets, step, gets in plan:
            for set_ in sets:
                set_()
            step(t)
            for get, keep, elements in gets:
                get()
                keep(bytes(elements))
    return process_time_ns() - before


def _step(member: Instance, version: int) -> Callable[[float], Any]:
    slave, component = member.slave, member.slave.component
    if version == 2:
        do_step = slave.fmi2DoStep
        return lambda t: do_step(component, t, _H, True)  # noqa: FBT003  (FMI's)
    do_step = slave.fmi3DoStep
    flags = [ctypes.byref(ctypes.c_bool()) for _ in range(3)]
    last = ctypes.byref(ctypes.c_double())
    return lambda t: do_step(component, t, _H, True, *flags, last)  # noqa: FBT003


def _run_methods(members: list[Instance], version: int, steps: int) -> int:
    """CPU time [ns]."""
    del version  # the methods of both are alike
    plan: list[tuple[Any, list[Any], list[Any]]] = []
    values: list[Any] = []
    records: list[list[Any]] = []
    for member in members:
        sets, gets = [], []
        for group in member.groups:
            if group.source is not None:
                source = len(values) - len(member.groups)
                sets.append((getattr(member.slave, f"set{group.type}"), list(group.inputs), source))
            values.append([])
            records.append([])
            own, keep = len(values) - 1, records[-1].append
            gets.append((getattr(member.slave, f"get{group.type}"), list(group.outputs), own, keep))
        plan.append((member.slave.doStep, sets, gets))
    before = process_time_ns()
    for n in range(steps):
        t = n * _H
        for step, sets, gets in plan:
            for set_, references, source in sets:
                set_(references, values[source])
            step(t, _H)
            for get, references, own, keep in gets:
                found = values[own] = get(references)
                keep(found)
    spent = process_time_ns() - before
    for group, found in zip(members[-1].groups, values[-len(members[-1].groups) :], strict=True):
        group.elements[:] = found
    return spent
