"""From a `Scenario` to components that exist and are connected."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TypeAlias

from orchestrator.algorithm.base import CosimulationAlgorithm, turns_of
from orchestrator.blame import blamed
from orchestrator.branching import branching_problems
from orchestrator.capabilities import PortableState
from orchestrator.component import Component
from orchestrator.declared import declared
from orchestrator.ending import ending_problem
from orchestrator.errors import (
    ComponentError,
    ComponentTypeError,
    CosimError,
    Location,
    ParameterError,
    Problem,
    ScenarioError,
    SystemStructureError,
    defects,
    in_words,
)
from orchestrator.feedthrough import describe_outcome, is_within, loops
from orchestrator.gaps import Gap, gaps
from orchestrator.input_files import Finding
from orchestrator.limits import OnFailure
from orchestrator.measure import Planned
from orchestrator.raised_at import raised_at
from orchestrator.recording.recorder import select
from orchestrator.scenario.diagnosis import once, spell
from orchestrator.scenario.document import Address, Document
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.model import ComponentUse, ConnectionUse, ConstantUse, Scenario
from orchestrator.scenario.outputs import belonging_here, sharing
from orchestrator.scenario.paths import anchored
from orchestrator.scenario.without import wrong_words
from orchestrator.system import Connection, Constant, Endpoint, System, elements, expand

Place: TypeAlias = Callable[[ComponentUse], Component]
"""Creates a component somewhere: in this process, or in another one."""


@dataclass(frozen=True, slots=True)
class Assembly:
    """What a simulation needs.

    Attributes:
        system: the components, connected.
        algorithm: checked against `system`.
        turns: the components in the order in which `algorithm` lets them step.
        remarks: what is not wrong, but may not be meant: inputs that a parameter asked for and
            nothing drives, and algebraic loops that the algorithm leaves with a delay.
    """

    system: System
    algorithm: CosimulationAlgorithm
    turns: tuple[str, ...]
    remarks: tuple[Problem, ...] = ()

    def close(self) -> None:
        """Close every component; for assemblies that are looked at and never simulated."""
        for component in self.system.components.values():
            component.close()


def in_process(use: ComponentUse) -> Component:
    """Create a component in this process."""
    return use.type.create(use.name, anchored(use.values))


def assemble(scenario: Scenario, place: Place = in_process) -> Assembly:
    """Create the components of `scenario` and connect them.

    Args:
        scenario: as `load_scenario` returns it.
        place: creates each component.

    Raises:
        ScenarioError: parameters or connections do not fit together; every problem is located
            at the connection or the component in the file.
        ComponentError: a component cannot be created, for a reason of its own.
    """
    with _closing_on_error() as components:
        problems = _create(scenario.document, scenario.components, place, components)
        if problems:
            raise _error(scenario, problems)
        problems = _ending_problems(scenario, components)
        origins, wrong = _connections(scenario.document, scenario.connections, components)
        constants, others = _constants(scenario.document, scenario.constants, components)
        wrong += others
        if wrong:
            raise _error(scenario, [*problems, *wrong])
        step_sizes = {name: use.step for name, use in scenario.components.items()}
        where = _Places(scenario, [*origins, *constants])
        try:
            system = System(
                components,
                step_sizes,
                tuple(connection for connection, _ in origins),
                tuple(constant for constant, _ in constants),
            )
        except SystemStructureError as error:
            found = [*problems, *map(where.locate, error.problems)]
            raise _error(scenario, found) from error
        problems += [
            Problem(scenario.document.key(("components", name)), what)
            for name, use in scenario.components.items()
            for what in branching_problems(system, [name] if use.type.decides else [])
        ]
        if problems:
            raise _error(scenario, problems)
        try:
            turns = turns_of(scenario.coupling.made, system)
        except SystemStructureError as error:
            raise scenario_error(scenario, ("coupling",), error) from error
        try:
            recorded = select(system, scenario.include, scenario.exclude)
        except SystemStructureError as error:
            raise scenario_error(scenario, ("recording",), error) from error
        always = {n: u for n, u in scenario.components.items() if u.process is Isolation.ALWAYS}
        open_ends = gaps(system, {name: use.without for name, use in scenario.components.items()})
        problems = [
            *wrong_words(scenario.document, scenario.components, system),
            *_undriven(scenario.document, open_ends, needed=True),
            *sharing(scenario.document, scenario.components),
            *belonging_here(scenario.document, always),
            *_unanswered(scenario, system, recorded),
            *_not_restartable(scenario, components),
        ]
        if problems:
            raise _error(scenario, problems)
        remarks = (
            *_undriven(scenario.document, open_ends, needed=False),
            *_unsolved(scenario.document, system, scenario.coupling.made),
        )
        return Assembly(system, scenario.coupling.made, turns, remarks)


def _unsolved(
    document: Document, system: System, algorithm: CosimulationAlgorithm
) -> Iterator[Problem]:
    """Remarks on algebraic loops that the algorithm leaves with a delay."""
    solved = algorithm.solved(system)
    for loop in loops(system):
        if not is_within(loop, solved):
            what = describe_outcome(loop, is_solved=False)
            yield Problem(document.key(("coupling",)), f"coupling: {what}")


def _not_restartable(scenario: Scenario, components: Mapping[str, Component]) -> Iterator[Problem]:
    """Components that are to be started again and cannot hand their state over."""
    for name, use in scenario.components.items():
        wanted = use.limits.on_failure is OnFailure.RESTART
        if wanted and components[name].capability(PortableState) is None:  # type: ignore[type-abstract]
            address = ("components", name, "on_failure")
            what = f"the state of `{name}` cannot leave its process, so it cannot be started again"
            yield Problem(scenario.document.key(address), f"{spell(address)}: {what}")


def _unanswered(
    scenario: Scenario, system: System, recorded: Iterable[Endpoint]
) -> Iterator[Problem]:
    """What the measures that the scenario names find wrong with what will be recorded."""
    signals = {str(end): system.connectors[end.component][end.connector] for end in recorded}
    planned = Planned(signals=signals, start=scenario.start, stop=scenario.stop)
    for name, use in (scenario.measures or {}).items():
        with blamed(f"the measure `{name}`, asked what it needs,"):
            yield from located(scenario.document, ("measures", name), use.made.check(planned))


def _undriven(document: Document, found: Iterable[Gap], *, needed: bool) -> Iterator[Problem]:
    """Inputs that nothing drives: those that are needed, or those that a parameter asked for."""
    for gap in found:
        if gap.is_needed is needed and (needed or (gap.undriven and gap.parameter)):
            inner = ("parameters", *gap.parameter) if gap.parameter else ()
            address = ("components", gap.component, *inner)
            yield Problem(document.key(address), f"{spell(address)}: {gap.message()}")


def _error(scenario: Scenario, problems: Sequence[Problem]) -> ScenarioError:
    return ScenarioError(once(scenario.document, problems))


@contextmanager
def _closing_on_error() -> Iterator[dict[str, Component]]:
    """Components that are closed if the assembly fails halfway."""
    components: dict[str, Component] = {}
    try:
        yield components
    except BaseException:
        _close(components)
        raise


def _close(components: Mapping[str, Component]) -> None:
    for component in components.values():
        with suppress(Exception):  # there is another error, which is the one to report
            component.close()


def problems_of_sound_parts(
    document: Document, components: Mapping[str, ComponentUse], connections: Sequence[ConnectionUse]
) -> list[Problem]:
    """What is wrong with the sound components of an unsound scenario, and between them.

    They are created in this process and closed again.

    Args:
        document: the scenario.
        components: those with nothing wrong so far, by name.
        connections: those of the scenario; of these the ones between `components` are checked.
    """
    created: dict[str, Component] = {}
    try:
        problems = _create(document, components, in_process, created)
        between = [
            use
            for use in connections
            if {use.source.partition(".")[0], use.target.partition(".")[0]} <= set(created)
        ]
        return problems + _connections(document, between, created)[1]
    except CosimError:
        return []  # no mistake of the scenario: reported once that is sound
    finally:
        _close(created)


def _create(
    document: Document,
    uses: Mapping[str, ComponentUse],
    place: Place,
    components: dict[str, Component],
) -> list[Problem]:
    """Fill `components`; the problems are parameters that a type refuses."""
    problems = []
    for name, use in uses.items():
        try:
            components[name] = place(use)
            declared(name, components[name])
        except (ComponentTypeError, ValueError) as error:
            problems += refusals(document, use, error)
        except CosimError:
            raise
        except defects() as error:  # anything else is a defect of the component
            reason = f"cannot be created: {in_words(error)}"
            raise ComponentError(name, None, reason, raised_at(error)) from error
    return problems


def refusals(document: Document, use: ComponentUse, error: Exception) -> list[Problem]:
    """What a component type says of parameters that it refuses, at those that it names."""
    if isinstance(error, ParameterError):
        top = ("components", use.name, "parameters")
        return list(located(document, top, error.problems))
    address = ("components", use.name)
    said = str(error).split("\n") if isinstance(error, ComponentTypeError) else [str(error)]
    return [
        Problem(
            document.key((*address, "parameters", *_named(what, use))), f"{spell(address)}: {what}"
        )
        for what in said
    ]


def located(document: Document, top: Address, found: Iterable[Finding]) -> Iterator[Problem]:
    """What is found in parameters, at its places in the scenario; what is in files, as it is.

    Args:
        document: the scenario.
        top: address of the parameters.
        found: problems or remarks.
    """
    for each in found:
        if isinstance(each, Problem):
            yield each
            continue
        inner = (*top, *each.address)
        where = document.key(inner) if each.at_key else document.value(inner)
        yield Problem(where, f"{spell(inner)}: {each.what}")


def _named(what: str, use: ComponentUse) -> tuple[str, ...]:
    """The parameter set by the scenario that `what` names first, if there is one."""
    found = [name for name in use.values if f"`{name}`" in what]
    return tuple(sorted(found, key=lambda name: what.index(f"`{name}`"))[:1])


def _ending_problems(scenario: Scenario, components: Mapping[str, Component]) -> list[Problem]:
    """What is wrong with the output that ends the run."""
    what = None if scenario.until is None else ending_problem(components, scenario.until)
    if what is None:
        return []
    address = ("time", "until")
    return [Problem(scenario.document.value(address), f"{spell(address)}: {what}")]


def _connections(
    document: Document,
    connections: Sequence[ConnectionUse],
    components: Mapping[str, Component],
) -> tuple[list[tuple[Connection, Location]], list[Problem]]:
    """Every connection with the place in the file that asks for it, and the problems.

    Args:
        document: the scenario.
        connections: as written.
        components: by name.
    """
    found: list[tuple[Connection, Location]] = []
    lines: dict[Connection, int] = {}
    problems: list[Problem] = []
    for use in connections:
        where, said = document.value(use.address), spell(document.written(use.address))
        try:
            expanded = expand(components, use.source, use.target, use.way)
        except SystemStructureError as error:
            problems += [Problem(where, f"{said}: {what}") for what in error.problems]
            continue
        for connection in expanded:
            if connection in lines and not use.way.adds:
                what = f"{connection} is connected in line {lines[connection]} already"
                problems.append(Problem(where, f"{said}: {what}"))
                continue
            lines[connection] = where.line
            found.append((connection, where))
    return found, problems


def _constants(
    document: Document, constants: Sequence[ConstantUse], components: Mapping[str, Component]
) -> tuple[list[tuple[Constant, Location]], list[Problem]]:
    """Every constant with the place in the file that asks for it, and the problems."""
    found: list[tuple[Constant, Location]] = []
    problems: list[Problem] = []
    for use in constants:
        where, said = document.value(use.address), spell(document.written(use.address))
        try:
            end, placed = elements(components, use.target)
        except ValueError as error:
            problems.append(Problem(where, f"{said}: {error}"))
        else:
            found.append((Constant(end, use.value, placed), where))
    return found, problems


@dataclass(frozen=True, slots=True)
class _Places:
    """Finds the place in the file that a sentence about the system is about."""

    scenario: Scenario
    origins: Sequence[tuple[Connection | Constant, Location]]

    def locate(self, what: str) -> Problem:
        """The place of what `what` names: a connection, a constant, a component, or the top."""
        document = self.scenario.document
        for each, where in self.origins:
            if what.startswith((f"cannot connect {each}:", f"cannot set {each}:")):
                return Problem(where, what)
        for name in self.scenario.components:
            if f"`{name}." in what or f"`{name}`" in what:
                return Problem(document.key(("components", name)), what)
        return Problem(document.key(("components",)), what)


def scenario_error(
    scenario: Scenario, address: Address, error: SystemStructureError
) -> ScenarioError:
    """`error` as problems of one part of the scenario file."""
    where = scenario.document.key(address)
    return ScenarioError([Problem(where, f"{spell(address)}: {p}") for p in error.problems])
