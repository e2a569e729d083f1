"""Inputs of one unit that are made of outputs, as the engine makes them."""

import ctypes
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from orchestrator.algorithm.mixing import MixedInput, Reading
from orchestrator.elements import Elements
from orchestrator.plan import layouts
from orchestrator.plan.memory import Outputs
from orchestrator.plan.past import MOST_BYTES, rows_of
from orchestrator.plan.sources import Sources
from orchestrator.signal import Array, Connector
from orchestrator.system import System
from orchestrator.transformation import Mix, Part

_WORKING: Final = np.dtype(np.float64)


def can_mix(
    system: System,
    shape: tuple[int, ...],
    mix: Mix,
    shape_of: Callable[[str, str], tuple[int, ...]],
) -> bool:
    """Whether the engine can make an input.

    Args:
        system: the components.
        shape: of the input.
        mix: how it is made.
        shape_of: the shape of an output.
    """
    if mix.dtype not in layouts.TYPES:
        return False
    for part in mix.parts:
        count = part.placed.places(shape).size
        for term in part.terms:
            dtype = system.connectors[term.component][term.output].dtype
            if dtype is None or np.dtype(dtype) not in layouts.TYPES:
                return False
            if not (isinstance(term.sample, int) and isinstance(term.delay, int)):
                return False
            if term.picked.places(shape_of(term.component, term.output)).size != count:
                return False
    return True


def can_remember(
    system: System, name: str, shape_of: Callable[[str, str], tuple[int, ...]]
) -> bool:
    """Whether the engine can keep of the outputs of a component what is asked of their past."""
    for mixes in system.mixes.values():
        for term in (t for mix in mixes for t in mix.terms):
            if term.component == name and (term.delay or term.sample):
                dtype = system.connectors[name][term.output].dtype
                if dtype is None or np.dtype(dtype) not in layouts.TYPES:
                    return False
                rows = rows_of(term.delay + term.sample, system.step_sizes[name])
                size = np.dtype(dtype).itemsize * int(np.prod(shape_of(name, term.output)))
                if rows * size > MOST_BYTES:
                    return False
    return True


class UnitMixes:
    """The mixed inputs of one unit.

    Args:
        mixed: in the order of the connectors.
        connectors: of the component.
        shapes: of the inputs, over the whole run.

    Attributes:
        table: what the engine reads.
    """

    def __init__(
        self,
        mixed: Sequence[MixedInput],
        connectors: Mapping[str, Connector],
        shapes: Mapping[str, tuple[int, ...]],
    ) -> None:
        own = {each.input: connectors[each.input] for each in mixed}
        self._mixed = {each.input: each for each in mixed}
        self._memory = Outputs(own, {name: shapes[name] for name in own})
        self._keep: list[Any] = []  # what the table points to
        self._terms: list[layouts.Term] = []
        self._sampled: list[tuple[Reading, layouts.Term, Array]] = []
        self.table = (layouts.Mix * len(own))()

    @property
    def inputs(self) -> list[str]:
        """Their names, in the order of the table."""
        return list(self._mixed)

    def source(self, name: str) -> layouts.Source:
        """An input, as the engine finds it."""
        mix = self.table[self.inputs.index(name)]
        return self._memory.source(name, ctypes.addressof(mix) + layouts.Mix.version.offset)

    def connect(self, sources: Sources) -> None:
        """Let them be made of outputs."""
        for table, each in zip(self.table, self._mixed.values(), strict=True):
            self._describe(table, each, sources)

    def _describe(self, table: layouts.Mix, mixed: MixedInput, sources: Sources) -> None:
        place = self._memory.places[mixed.input]
        start = np.broadcast_to(np.asarray(mixed.start), place.shape)
        working = _WORKING if place.dtype.kind == "f" else place.dtype
        readings = iter(mixed.readings)
        parts = [self._part(part, place.shape, readings, sources) for part in mixed.mix.parts]
        table.part = self._kept((layouts.Part * len(parts))(*parts))
        table.parts, table.count = len(parts), int(np.prod(place.shape, dtype=np.int64))
        table.start = table.rest = self._array(start.astype(working))
        for scratch in ("made", "sum", "value"):
            setattr(table, scratch, self._array(np.zeros(table.count, _WORKING)))
        table.input = int(self._memory.block.ctypes.data) + place.offset
        table.size, table.type = place.size, layouts.TYPES[place.dtype]

    def _part(
        self, part: Part, shape: tuple[int, ...], readings: Iterator[Reading], sources: Sources
    ) -> layouts.Part:
        terms = (layouts.Term * len(part.terms))()
        for table in terms:
            self._term(table, next(readings), sources)
        return layouts.Part(
            self._kept(terms),
            len(terms),
            self._places(part.placed, shape),
            _count(part.placed, shape),
        )

    def _term(self, table: layouts.Term, reading: Reading, sources: Sources) -> None:
        term = reading.term
        shape = sources.shape(term.component, term.output)
        dtype = sources.dtype(term.component, term.output)
        table.source = sources.of(term.component, term.output)
        table.delay, table.sample = term.delay, term.sample
        if term.delay or term.sample:
            table.past = ctypes.pointer(sources.past(term.component, term.output))
        if term.sample:
            held: Array = np.zeros(shape, dtype)
            table.held = self._array(held)
            self._sampled.append((reading, table, held))
        self._terms.append(table)
        table.index, table.count = self._places(term.picked, shape), _count(term.picked, shape)
        operations = [layouts.Operation(o.kind, 0, o.number) for o in term.operations]
        table.operation = self._kept((layouts.Operation * len(operations))(*operations))
        table.operations, table.type = len(operations), layouts.TYPES[dtype]

    def _places(self, elements: Elements, shape: tuple[int, ...]) -> int | None:
        return None if elements.are_all else self._array(elements.places(shape).ravel())

    def _array(self, values: Array) -> int:
        """The address of `values`, which live as long as the plan."""
        kept: Array = self._kept(np.asarray(values, order="C"))
        return int(kept.ctypes.data)

    def _kept(self, what: Any) -> Any:
        self._keep.append(what)
        return what

    def enter(self) -> None:
        """Take over what Python sampled; every input is made anew."""
        for table in self.table:
            table.is_new = True
        for term in self._terms:
            term.at = 0
        for reading, term, held in self._sampled:
            term.held_number = 0
            if reading.held is not None and reading.held_from is not None:
                held[...] = reading.held
                term.held_from, term.held_number = reading.held_from, 1

    def leave(self) -> None:
        """Let Python know what was sampled."""
        for reading, term, held in self._sampled:
            reading.held = reading.held_from = None
            if term.held_number:
                reading.held, reading.held_from = held.copy(), term.held_from


def _count(elements: Elements, shape: tuple[int, ...]) -> int:
    return int(elements.places(shape).size)
