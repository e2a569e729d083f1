"""A system: components, their step sizes and the connections between their connectors.

The words are those of SSP. Everything that can be known to be wrong before the first step is
found when a `System` is created, and all of it is reported at once.
"""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Final

from orchestrator.component import Component
from orchestrator.connection import (
    Claim,
    Connection,
    Connectors,
    Endpoint,
    Feed,
    claim,
    overlap,
    routed,
)
from orchestrator.constant import Constant, with_constant
from orchestrator.declared import declared
from orchestrator.elements import WHOLE, Elements
from orchestrator.errors import SystemStructureError
from orchestrator.signal import Causality, Connector
from orchestrator.suggestion import suggestion
from orchestrator.timebase import StepSize
from orchestrator.transformation import PLAIN, Mix, Transformation, problems as problems_between

_NAME: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_-]*")
"""Component names become folders of a recording and keys of a transport."""


@dataclass(frozen=True, slots=True)
class System:
    """Components and connections that fit together; checked once, here.

    Attributes:
        components: by name; their order breaks ties wherever an order is needed.
        step_sizes: communication step size of each component [ns].
        connections: at most one per element of an input, and those that are added to it. Elements
            without one keep their start value.
        constants: that inputs have in place of a source.
        connectors: of each component, asked for once; constants are start values in them.
        feeds: the inputs of each component that take an output as it is, in the order of its
            connectors.
        mixes: its inputs that are made of outputs in another way, in the same order.

    Raises:
        SystemStructureError: one sentence per problem, all of them.
        ComponentError: what a component declares are no connectors.
    """

    components: Mapping[str, Component]
    step_sizes: Mapping[str, StepSize]
    connections: Sequence[Connection]
    constants: Sequence[Constant] = ()
    connectors: Mapping[str, Connectors] = field(init=False, repr=False)
    feeds: Mapping[str, tuple[Feed, ...]] = field(init=False, repr=False)
    mixes: Mapping[str, tuple[Mix, ...]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        own = {name: declared(name, component) for name, component in self.components.items()}
        claims: dict[Endpoint, list[Claim]] = defaultdict(list)
        wrong = list(_set_constants(own, self.constants, claims))
        connectors = {name: MappingProxyType(each) for name, each in own.items()}
        drivers = {link.target: link.source for link in self.connections}
        problems = [
            *_component_problems(self.components, self.step_sizes),
            *_start_problems(connectors),
            *_feedthrough_problems(connectors),
            *wrong,
            *_connection_problems(connectors, self.step_sizes, self.connections, claims),
            *_axis_problems(connectors, drivers),
            *_event_problems(connectors, self.step_sizes, self.connections),
        ]
        if problems:
            raise SystemStructureError(problems)
        feeds, mixes = routed(connectors, self.connections)
        for name, value in (
            ("components", MappingProxyType(dict(self.components))),
            ("step_sizes", MappingProxyType(dict(self.step_sizes))),
            ("connections", tuple(self.connections)),
            ("constants", tuple(self.constants)),
            ("connectors", MappingProxyType(connectors)),
            ("feeds", MappingProxyType(feeds)),
            ("mixes", MappingProxyType(mixes)),
        ):
            object.__setattr__(self, name, value)

    def driven(self, component: str) -> frozenset[str]:
        """The inputs of a component that have a source or a constant, at least in part."""
        ends = (*(c.target for c in self.connections), *(c.target for c in self.constants))
        return frozenset(end.connector for end in ends if end.component == component)


def expand(
    components: Mapping[str, Component], source: str, target: str, way: Transformation = PLAIN
) -> tuple[Connection, ...]:
    """The connections that a scenario means by `from: source` and `to: target`.

    If `target` names a connector, or elements of one, this is one connection. Otherwise
    it names a group: every input beneath it (`channel.vehicle` has `channel.vehicle.position`
    beneath it) is connected to the output of the same name beneath `source`.

    Args:
        components: by name.
        source: a connector, elements of it such as `a.x[2]`, or a group.
        target: the same.
        way: of every value; without the elements that the ends name.

    Raises:
        SystemStructureError: an end does not exist, `target` has no inputs beneath it, or an
            input beneath it finds no output beneath `source`; one sentence per problem.
    """
    try:
        (start, picked), (end, placed) = (elements(components, e) for e in (source, target))
    except ValueError as error:
        raise SystemStructureError([f"cannot connect `{source}` to `{target}`: {error}"]) from None
    whole = Connection(start, end, replace(way, picked=picked, placed=placed))
    for end in (whole.source, whole.target):
        if end.component not in components:
            hint = suggestion(end.component, components)
            raise SystemStructureError(
                [f"cannot connect {whole}: there is no component `{end.component}`; {hint}"]
            )
    outputs = components[whole.source.component].connectors
    inputs = components[whole.target.component].connectors
    is_one = whole.target.connector in inputs or not (picked.are_all and placed.are_all)
    pairs = [whole] if is_one else _group(whole, inputs)
    missing = [
        f"cannot connect {pair}: {_unknown(end, known)}"
        for pair in pairs
        for end, known in ((pair.source, outputs), (pair.target, inputs))
        if end.connector not in known
    ]
    if missing:
        raise SystemStructureError(missing)
    return tuple(pairs)


def elements(components: Mapping[str, Component], text: str) -> tuple[Endpoint, Elements]:
    """The end that `text` names, and its elements; a connector may be called `x[2]` itself.

    Raises:
        ValueError: it names no end, or what is in its brackets is no element.
    """
    whole = Endpoint.parse(text)
    component = components.get(whole.component)
    if component is None or whole.connector in component.connectors:
        return whole, WHOLE
    found = Elements.split(whole.connector)
    return (whole, WHOLE) if found is None else (replace(whole, connector=found[0]), found[1])


def _group(whole: Connection, inputs: Connectors) -> list[Connection]:
    """One connection for every input beneath the target of `whole`."""
    source, target = whole.source, whole.target
    beneath = [
        name.removeprefix(target.connector)
        for name, connector in inputs.items()
        if name.startswith(f"{target.connector}.") and connector.causality is Causality.INPUT
    ]
    if not beneath:
        groups = {name[:dot] for name in inputs for dot in _dots(name)}
        hint = suggestion(target.connector, {*inputs, *groups})
        problem = f"`{target.component}` has no input `{target.connector}`, nor any beneath it"
        raise SystemStructureError([f"cannot connect {whole}: {problem}; {hint}"])
    return [
        Connection(
            Endpoint(source.component, source.connector + rest),
            Endpoint(target.component, target.connector + rest),
            whole.way,
        )
        for rest in beneath
    ]


def _dots(name: str) -> list[int]:
    return [index for index, character in enumerate(name) if character == "."]


def _unknown(end: Endpoint, connectors: Connectors) -> str:
    hint = suggestion(end.connector, connectors)
    return f"`{end.component}` has no connector `{end.connector}`; {hint}"


def _component_problems(
    components: Mapping[str, Component], step_sizes: Mapping[str, StepSize]
) -> Iterator[str]:
    if not components:
        yield "the system has no components"
    for name in components:
        if not _NAME.fullmatch(name):
            yield (
                f"`{name}` cannot be the name of a component; "
                "write letters, digits, `_` and `-` (not first)"
            )
        if name not in step_sizes:
            yield f"component `{name}` has no step size"
        elif step_sizes[name] <= 0:
            yield f"component `{name}`: its step size must be positive, got {step_sizes[name]} ns"
    names: dict[int, str] = {}
    for name, component in components.items():
        if names.setdefault(id(component), name) != name:
            yield f"`{names[id(component)]}` and `{name}` are one and the same instance"
    for name in step_sizes:
        if name not in components:
            yield f"a step size is given for `{name}`; {suggestion(name, components)}"


def _start_problems(connectors: Mapping[str, Connectors]) -> Iterator[str]:
    for component, own in connectors.items():
        for name, connector in own.items():
            try:
                violations = connector.violations(connector.start_value())
            except (TypeError, ValueError) as error:
                violations = [str(error)]
            for violation in violations:
                yield f"`{component}.{name}`: its start value {violation}"


def _feedthrough_problems(connectors: Mapping[str, Connectors]) -> Iterator[str]:
    for component, own in connectors.items():
        inputs = [name for name, c in own.items() if c.causality is Causality.INPUT]
        for name, connector in own.items():
            for cause in sorted(connector.feedthrough.difference(inputs)):
                yield (
                    f"`{component}.{name}` declares feedthrough from `{cause}`, which is not an "
                    f"input of `{component}`; {suggestion(cause, inputs)}"
                )


def _connection_problems(
    connectors: Mapping[str, Connectors],
    step_sizes: Mapping[str, StepSize],
    connections: Sequence[Connection],
    claims: dict[Endpoint, list[Claim]],
) -> Iterator[str]:
    for link in connections:
        differences = list(_end_problems(connectors, link))
        earlier = claims[link.target]
        if not differences:
            output = connectors[link.source.component][link.source.connector]
            input_ = connectors[link.target.component][link.target.connector]
            step = max(step_sizes.get(link.target.component, 0), 1)  # others are problems, too
            differences = problems_between(output, input_, link.way, step)
            if not link.way.adds:
                differences += overlap(input_, earlier, link.way.placed)
            elif not earlier or earlier[-1].placed != link.way.placed:
                differences.append("no connection to the same elements comes before it")
        elif earlier:
            differences.append(f"{earlier[0].who} drives it already")
        earlier.append(claim(link))
        if differences:
            yield f"cannot connect {link}: {'; '.join(differences)}"


def _set_constants(
    connectors: dict[str, dict[str, Connector]],
    constants: Sequence[Constant],
    claims: dict[Endpoint, list[Claim]],
) -> Iterator[str]:
    """Put constants into the start values of inputs; the problems that there are."""
    for constant in constants:
        end = constant.target
        own = connectors.get(end.component, {})
        if end.connector not in own:
            missing = Connection(end, end)
            yield f"cannot set {constant}: {next(_end_problems(connectors, missing))}"
            continue
        found = overlap(own[end.connector], claims[end], constant.placed)
        claims[end].append(Claim("a constant", constant.placed))
        try:
            own[end.connector] = with_constant(own[end.connector], constant)
        except ValueError as error:
            found.append(str(error))
        if found:
            yield f"cannot set {constant}: {'; '.join(found)}"


def _end_problems(connectors: Mapping[str, Connectors], link: Connection) -> Iterator[str]:
    for end in (link.source, link.target):
        if end.component not in connectors:
            hint = suggestion(end.component, connectors)
            yield f"there is no component `{end.component}`; {hint}"
        elif end.connector not in connectors[end.component]:
            yield _unknown(end, connectors[end.component])


def _axis_problems(
    connectors: Mapping[str, Connectors], drivers: Mapping[Endpoint, Endpoint]
) -> Iterator[str]:
    """Inputs without a source whose length cannot follow that of their driven siblings.

    `Connector.shape` promises equal lengths along equally named axes of a component; an input
    that keeps its start value while another one grows would break that promise at run time.
    """
    for component, own in connectors.items():
        driven: dict[str, Endpoint] = {}
        held: dict[str, list[Endpoint]] = {}
        for name, connector in own.items():
            end = Endpoint(component, name)
            for axis in connector.shape:
                if isinstance(axis, int) or connector.causality is not Causality.INPUT:
                    continue
                if end in drivers:
                    driven.setdefault(axis, end)
                else:
                    held.setdefault(axis, []).append(end)
        for axis, ends in held.items():
            if axis in driven:
                names = ", ".join(f"`{end}`" for end in ends)
                yield (
                    f"{names}: no source, but `{driven[axis]}` along the same axis `{axis}` has "
                    f"one; connect all inputs along `{axis}` or none"
                )


def _event_problems(
    connectors: Mapping[str, Connectors],
    step_sizes: Mapping[str, StepSize],
    connections: Sequence[Connection],
) -> Iterator[str]:
    """Events that would be replaced before their reader looks at them."""
    for link in connections:
        output = connectors.get(link.source.component, {}).get(link.source.connector)
        if output is None or not output.carries_events:
            continue
        written, read = (step_sizes.get(e.component, 0) for e in (link.source, link.target))
        if read > written > 0:
            yield (
                f"cannot connect {link}: it carries events, and `{link.target.component}` with a "
                f"step size of {read} ns would miss those of `{link.source.component}`, which "
                f"steps every {written} ns; give both the same step size"
            )


__all__ = [
    "Connection",
    "Connectors",
    "Constant",
    "Endpoint",
    "Feed",
    "System",
    "elements",
    "expand",
]
