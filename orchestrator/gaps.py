"""Inputs that nothing drives: which of them a component needs, and what it means of the others.

A connector says what its absence means (`orchestrator.absence.Undriven`). Inputs of one group that
say the same are one gap: `channel.vehicle.*` is one mistake, not six. Each gap is told with the
outputs of other components that would fill it, so that the sentence says what to write.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final, TypeAlias

from orchestrator.absence import Need, Undriven
from orchestrator.connection import Connectors, Endpoint
from orchestrator.signal import Causality, Connector
from orchestrator.system import System

_NOTHING: Final[Mapping[str, Sequence[str]]] = MappingProxyType({})

_MOST: Final = 4
"""Outputs that are named; more are no help."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """Inputs of one component that nothing drives, and that have the same to say about it.

    Attributes:
        component: its name.
        group: what they are called together: `vehicle.*`, or the only one, or all of them.
        inputs: their names.
        undriven: what they declare; `None` where the component is silent, such as a foreign FMU,
            whose inputs keep their start values.
        is_needed: whether that is wrong here.
        is_meant: whether the scenario says that nothing shall drive them.
        fits: what a connection could name as its source, the best alone: outputs, or groups of
            them, that the component does not read yet.
        parameter: as that of the connectors.
    """

    component: str
    group: str
    inputs: tuple[str, ...]
    undriven: Undriven | None
    is_needed: bool = False
    is_meant: bool = False
    fits: tuple[str, ...] = ()
    parameter: tuple[str | int, ...] = ()

    @property
    def title(self) -> str:
        """The group with the number of its inputs, if it has several."""
        count = f" ({len(self.inputs)} inputs)" if len(self.inputs) > 1 else ""
        return f"`{self.component}.{self.group}`{count}"

    @property
    def meaning(self) -> str:
        """What its absence means, in words."""
        if self.undriven is None:
            return "the start value stays"
        return self.undriven.meaning

    def message(self) -> str:
        """The sentence of an error or a remark."""
        if len(self.inputs) == 1:
            return f"nothing drives {self.title}: {self.meaning}{self._advice()}"
        return f"{self.title}: nothing drives them: {self.meaning}{self._advice()}"

    def data(self) -> dict[str, Any]:
        """Say the same in words of JSON."""
        return {
            "component": self.component,
            "inputs": list(self.inputs),
            "declared": self.undriven is not None,
            "need": None if self.undriven is None else self.undriven.need.value,
            "meaning": self.meaning,
            "meant": self.is_meant,
            "fits": list(self.fits),
        }

    def _advice(self) -> str:
        named = [f"`{each}`" for each in self.fits]
        if not named or len(named) > _MOST:
            return self._way_out()
        verb = "fits" if len(named) == 1 else "fit"
        listed = " and ".join([*filter(None, [", ".join(named[:-1])]), named[-1]])
        return f"; {listed} {verb}{self._way_out()}"

    def _way_out(self) -> str:
        """How to say that it is meant; a group is one word, if it is nothing else."""
        if not self.is_needed or self.parameter:  # a parameter has its own way
            return ""
        return f"; `without: [{self.group.removesuffix('.*')}]` if that is meant"


def gaps(system: System, without: Mapping[str, Sequence[str]] = _NOTHING) -> tuple[Gap, ...]:
    """The inputs of `system` that nothing drives, in the order of components and connectors.

    Args:
        system: the components and their connections.
        without: inputs, and groups of them, that nothing shall drive, by component.
    """
    return tuple(
        gap if gap.is_meant else _judged(system, gap)
        for name, connectors in system.connectors.items()
        for gap in _grouped(name, connectors, system.driven(name), without.get(name, ()))
    )


def declared(connectors: Connectors) -> tuple[Gap, ...]:
    """What one component says about all its inputs, as if nothing drove any of them."""
    found = _grouped("", connectors, frozenset(), ())
    return tuple(gap for gap in found if gap.undriven is not None)


_Alike: TypeAlias = tuple[str, Undriven | None, tuple[str | int, ...], bool]


def _grouped(
    name: str, connectors: Connectors, driven: frozenset[str], without: Sequence[str]
) -> Iterator[Gap]:
    alike: dict[_Alike, list[str]] = defaultdict(list)
    for key, connector in connectors.items():
        if connector.causality is Causality.INPUT and key not in driven:
            group = key.rpartition(".")[0] or key
            is_meant = is_among(key, without)
            alike[group, connector.undriven, connector.parameter, is_meant].append(key)
    for (group, said, parameter, is_meant), inputs in alike.items():
        needed = said is not None and said.need is Need.ALWAYS
        yield Gap(
            component=name,
            group=_called(group, inputs, connectors),
            inputs=tuple(inputs),
            undriven=said,
            is_needed=needed and not is_meant,
            is_meant=is_meant,
            parameter=parameter,
        )


def _called(group: str, inputs: Sequence[str], connectors: Connectors) -> str:
    if len(inputs) == 1:
        return inputs[0]
    beneath = [
        key
        for key, connector in connectors.items()
        if key.startswith(f"{group}.") and connector.causality is Causality.INPUT
    ]
    return f"{group}.*" if beneath == list(inputs) else ", ".join(inputs)


def is_among(input_: str, said: Iterable[str]) -> bool:
    """Whether an input is one of these, or beneath a group among these."""
    return any(input_ == each or input_.startswith(f"{each}.") for each in said)


def _judged(system: System, gap: Gap) -> Gap:
    """The gap with what would fill it."""
    if gap.undriven is None:
        return gap
    fits, is_named_so = _fitting(system, gap)
    is_offered = is_named_so or len(fits) == 1
    is_missed = gap.undriven.need is Need.IF_OFFERED and is_offered
    if not gap.undriven.beside.isdisjoint(system.driven(gap.component)):
        is_missed |= bool(fits)
    return replace(gap, fits=fits, is_needed=gap.is_needed or is_missed)


def _fitting(system: System, gap: Gap) -> tuple[tuple[str, ...], bool]:
    """The best sources for a gap, and whether they are called as its inputs are."""
    own = {key: system.connectors[gap.component][key] for key in gap.inputs}
    taken = {c.source for c in system.connections if c.target.component == gap.component}
    group = gap.inputs[0].rpartition(".")[0]
    last = gap.inputs[0].rpartition(".")[2]
    alike: list[str] = []
    similar: list[str] = []
    of_type: list[str] = []
    for name, connectors in system.connectors.items():
        if name == gap.component:
            continue
        free = {k: c for k, c in connectors.items() if Endpoint(name, k) not in taken}
        for prefix in _prefixes(group, own, free):
            shown = prefix if len(own) > 1 else _joined(prefix, last)
            if prefix == group:
                alike.append(f"{name}.{shown}")
            elif prefix.rpartition(".")[2] == group.rpartition(".")[2]:
                similar.append(f"{name}.{shown}")
            elif len(own) > 1:
                of_type.append(f"{name}.{shown}")
        if len(own) == 1:
            (input_,) = own.values()
            for key, output in free.items():
                if output.differences(input_) or f"{name}.{key}" in (*alike, *similar):
                    continue
                if key.rpartition(".")[2] == last:
                    similar.append(f"{name}.{key}")
                elif _is_telling(input_):
                    of_type.append(f"{name}.{key}")
    return tuple(alike or similar or of_type), bool(alike)


def _prefixes(group: str, own: Connectors, free: Connectors) -> Iterator[str]:
    """The groups of outputs that have one of the right kind for each input."""
    rests = {key[len(group) + 1 :] if group else key: own[key] for key in own}
    first = next(iter(rests))
    for key in free:
        prefix, found = ("", key == first) if "." not in key else _without(key, first)
        if len(own) > 1 and not prefix:
            continue  # a connection names a group
        if found and all(_fits(free.get(_joined(prefix, r)), c) for r, c in rests.items()):
            yield prefix


def _without(key: str, rest: str) -> tuple[str, bool]:
    return key.removesuffix(f".{rest}"), key == rest or key.endswith(f".{rest}")


def _joined(prefix: str, rest: str) -> str:
    return f"{prefix}.{rest}" if prefix else rest


def _fits(output: Connector | None, input_: Connector) -> bool:
    return output is not None and not output.differences(input_)


def _is_telling(connector: Connector) -> bool:
    """Whether few other signals have the type of this one."""
    if connector.is_binary:
        return not connector.is_text and "x-" in connector.mime_type
    return any(isinstance(axis, str) for axis in connector.shape)
