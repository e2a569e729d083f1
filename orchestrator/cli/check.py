"""`nlosim check`."""

from argparse import Namespace
from collections.abc import Container, Iterator, Mapping
from pathlib import Path
from typing import Final

from orchestrator.algorithm.exchange import Exchange
from orchestrator.branching import Branching
from orchestrator.cli import check_experiment
from orchestrator.cli.failures import problem_data
from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.cli.streams import tell_line as tell
from orchestrator.errors import CosimError, Problem, ScenarioError
from orchestrator.hosts_file import read_hosts
from orchestrator.last_call import NOWHERE
from orchestrator.native import NativeOwner
from orchestrator.placement import Placement, only_hosts, placing
from orchestrator.resuming.manners import manners_of
from orchestrator.scenario.absent import absence
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.diagnosis import once
from orchestrator.scenario.inputs import check_inputs
from orchestrator.scenario.installed import scenario_path
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.model import ComponentUse, Scenario
from orchestrator.scenario.outputs import belonging_here
from orchestrator.scenario.processes import crowding, uncopied
from orchestrator.scenario.wiring import Assembly, Place, assemble, problems_of_sound_parts


def execute(arguments: Namespace) -> Outcome:
    """Find every problem that can be found without running."""
    path = scenario_path(arguments.scenario)
    if check_experiment.is_one(path):
        return check_experiment.execute(arguments, path)
    try:
        scenario = load_scenario(path, arguments.overrides)
        hosts = None if arguments.hosts is None else read_hosts(Path(arguments.hosts))
        placed = only_hosts(scenario, hosts)
        missing = _not_here(scenario, placed)
        with placing(placed, tell) as places:
            if missing:
                file_remarks, connections = _look_at_the_rest(scenario, missing)
                of_wiring: tuple[Problem, ...] = ()
                of_return: tuple[str, ...] = ()
            else:
                file_remarks, assembly = _examine(scenario, places.create, placed.away)
                connections, of_wiring = len(assembly.system.connections), assembly.remarks
                of_return = _manners_of_return(scenario, assembly) if arguments.checkpoint else ()
                assembly.close()
    except ScenarioError as error:
        return Outcome(
            text="\n".join(map(str, error.problems)),
            data={"problems": [problem_data(problem) for problem in error.problems]},
            exit_code=Exit.WRONG_INPUT,
        )
    document, uses = scenario.document, scenario.components
    elsewhere = {*placed.away, *missing}
    together = {
        n: u for n, u in uses.items() if u.process is not Isolation.ALWAYS and n not in elsewhere
    }
    misplaced = once(document, [*crowding(document, together), *belonging_here(document, together)])
    not_copied = uncopied(document, uses)
    found = (
        *scenario.remarks,
        *file_remarks,
        *of_wiring,
        *missing.values(),
        *misplaced,
        *not_copied,
    )
    remarks = [problem_data(remark) for remark in found]
    lines = [
        *(f"{remark} (a remark)" for remark in found),
        f"{arguments.scenario}: {_verdict(uses, missing)}, {connections} connections",
        *_manners(scenario),
        *_marked(scenario),
        *of_return,
        *_on_hosts(scenario, asked=hosts is not None),
    ]
    return Outcome(
        text="\n".join(lines),
        data={"problems": [], **({"remarks": remarks} if remarks else {})},
    )


def _verdict(uses: Mapping[str, ComponentUse], missing: Mapping[str, Problem]) -> str:
    names = ", ".join(f"`{name}`" for name in missing)
    rest = f" without {names}, which cannot be checked here" if missing else ""
    return f"ok{rest}, {len(uses)} components"


def _not_here(scenario: Scenario, placed: Placement) -> dict[str, Problem]:
    """Components whose types are on hosts that were not asked, and why they are not here."""
    found = {}
    for name, use in scenario.components.items():
        if name not in placed.away:
            for problem in absence(scenario.document, name, use.type, use.host):
                found[name] = problem
    return found


def _look_at_the_rest(
    scenario: Scenario, missing: Mapping[str, Problem]
) -> tuple[list[Problem], int]:
    """Remarks about the files of the other components, and how many connections are in all.

    Raises:
        ScenarioError: what is wrong with them, and between them.
    """
    remarks = check_inputs(scenario, thorough=True, without=missing)
    here = {name: use for name, use in scenario.components.items() if name not in missing}
    problems = problems_of_sound_parts(scenario.document, here, scenario.connections)
    if problems:
        raise ScenarioError(once(scenario.document, problems))
    return remarks, len(scenario.connections)


def _on_hosts(scenario: Scenario, *, asked: bool) -> Iterator[str]:
    """What `host` means, at the first line that names each host."""
    hosts: dict[str, list[str]] = {}
    for name, use in scenario.components.items():
        if use.host is not None:
            hosts.setdefault(use.host, []).append(name)
    for host, names in hosts.items():
        place = scenario.document.key(("components", names[0], "host"))
        listed = ", ".join(f"`{name}`" for name in names)
        verb = "were found there" if asked else "takes effect with `nlosim run --hosts FILE`"
        rest = "" if asked else ", and `nlosim serve` there; without it they run here"
        yield f"{place}: {listed}: `host: {host}` {verb}{rest}"


def _manners(scenario: Scenario) -> list[str]:
    """How components work that have something to say about it."""
    document = scenario.document
    found = {name: use.type.manner(use.values) for name, use in scenario.components.items()}
    return [
        f"{document.key(('components', name))}: `{name}`: {manner}"
        for name, manner in found.items()
        if manner
    ]


def _manners_of_return(scenario: Scenario, assembly: Assembly) -> tuple[str, ...]:
    """How components come back to a checkpoint, as far as that is known before a run."""
    system, algorithm = assembly.system, assembly.algorithm
    exchange = Exchange(system, Branching(system, scenario.stop, scenario.seed), NOWHERE)
    native = [
        name
        for name, component in system.components.items()
        if component.capability(NativeOwner) is not None  # type: ignore[type-abstract]
    ]
    manners = manners_of(
        system,
        knows_itself=algorithm.of_run(system, exchange).memory() is not None,
        compiled=native if algorithm.pattern is not None else [],
    )
    return tuple(manners.lines())


_MEANING: Final = {
    Isolation.ALWAYS: "means a process of its own; `nlosim run --transport in-process` undoes it",
    Isolation.ON_REQUEST: "takes effect with `nlosim run --transport local` (or `zenoh`); "
    "without it they run in the orchestrator's process",
}


def _marked(scenario: Scenario) -> Iterator[str]:
    """What `process` means, at the first line that says so."""
    for isolation, meaning in _MEANING.items():
        marked = [name for name, use in scenario.components.items() if use.process is isolation]
        if marked:
            place = scenario.document.key(("components", marked[0], "process"))
            names = ", ".join(f"`{name}`" for name in marked)
            yield f"{place}: {names}: `process: {isolation.written}` {meaning}"


def _examine(
    scenario: Scenario, place: Place, away: Container[str]
) -> tuple[list[Problem], Assembly]:
    """Remarks about the files of a scenario, and its components, connected.

    Args:
        scenario: whose components are created.
        place: creates each.
        away: components whose files are elsewhere.

    Raises:
        ScenarioError: the problems of both.
        ComponentError: a component cannot be created, or cannot check its files.
    """
    try:
        remarks = check_inputs(scenario, thorough=True, without=away)
    except ScenarioError as wrong_files:
        try:
            assemble(scenario, place).close()
        except ScenarioError as error:
            both = dict.fromkeys((*error.problems, *wrong_files.problems))
            raise ScenarioError(list(both)) from error
        except CosimError:
            pass  # a component fails with files that are wrong
        raise
    return remarks, assemble(scenario, place)
