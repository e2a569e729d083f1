"""`nlosim check`."""

from argparse import Namespace

from orchestrator.cli.failures import problem_data
from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.errors import ScenarioError
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.installed import scenario_path
from orchestrator.scenario.wiring import assemble


def execute(arguments: Namespace) -> Outcome:
    """Find every problem that can be found without running."""
    try:
        scenario = load_scenario(scenario_path(arguments.scenario), arguments.overrides)
        assembly = assemble(scenario)
    except ScenarioError as error:
        return Outcome(
            text="\n".join(map(str, error.problems)),
            data={"problems": [problem_data(problem) for problem in error.problems]},
            exit_code=Exit.WRONG_INPUT,
        )
    assembly.close()
    components, connections = len(scenario.components), len(assembly.system.connections)
    remarks = [problem_data(remark) for remark in scenario.remarks]
    lines = [
        *(f"{remark} (a remark)" for remark in scenario.remarks),
        f"{arguments.scenario}: ok, {components} components, {connections} connections",
    ]
    return Outcome(
        text="\n".join(lines),
        data={"problems": [], **({"remarks": remarks} if remarks else {})},
    )
