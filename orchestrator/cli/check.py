"""`nlosim check`."""

from argparse import Namespace
from collections.abc import Iterator
from typing import Final

from orchestrator.cli.failures import problem_data
from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.errors import CosimError, Problem, ScenarioError
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.diagnosis import once
from orchestrator.scenario.inputs import check_inputs
from orchestrator.scenario.installed import scenario_path
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.outputs import belonging_here
from orchestrator.scenario.processes import crowding, uncopied
from orchestrator.scenario.wiring import Assembly, assemble


def execute(arguments: Namespace) -> Outcome:
    """Find every problem that can be found without running."""
    try:
        scenario = load_scenario(scenario_path(arguments.scenario), arguments.overrides)
        file_remarks, assembly = _examine(scenario)
    except ScenarioError as error:
        return Outcome(
            text="\n".join(map(str, error.problems)),
            data={"problems": [problem_data(problem) for problem in error.problems]},
            exit_code=Exit.WRONG_INPUT,
        )
    assembly.close()
    components, connections = len(scenario.components), len(assembly.system.connections)
    document, uses = scenario.document, scenario.components
    together = {n: u for n, u in uses.items() if u.process is not Isolation.ALWAYS}
    placed = once(document, [*crowding(document, together), *belonging_here(document, together)])
    not_copied = uncopied(document, uses)
    found = (*scenario.remarks, *file_remarks, *assembly.remarks, *placed, *not_copied)
    remarks = [problem_data(remark) for remark in found]
    lines = [
        *(f"{remark} (a remark)" for remark in found),
        f"{arguments.scenario}: ok, {components} components, {connections} connections",
        *_manners(scenario),
        *_marked(scenario),
    ]
    return Outcome(
        text="\n".join(lines),
        data={"problems": [], **({"remarks": remarks} if remarks else {})},
    )


def _manners(scenario: Scenario) -> list[str]:
    """How components work that have something to say about it."""
    document = scenario.document
    found = {name: use.type.manner(use.values) for name, use in scenario.components.items()}
    return [
        f"{document.key(('components', name))}: `{name}`: {manner}"
        for name, manner in found.items()
        if manner
    ]


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


def _examine(scenario: Scenario) -> tuple[list[Problem], Assembly]:
    """Remarks about the files of a scenario, and its components, connected.

    Raises:
        ScenarioError: the problems of both.
        ComponentError: a component cannot be created, or cannot check its files.
    """
    try:
        remarks = check_inputs(scenario, thorough=True)
    except ScenarioError as wrong_files:
        try:
            assemble(scenario).close()
        except ScenarioError as error:
            both = dict.fromkeys((*error.problems, *wrong_files.problems))
            raise ScenarioError(list(both)) from error
        except CosimError:
            pass  # a component fails with files that are wrong
        raise
    return remarks, assemble(scenario)
