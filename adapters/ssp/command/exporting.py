"""`nlosim ssp export`."""

from argparse import Namespace
from pathlib import Path

from adapters.ssp.exporting import export_scenario
from orchestrator.cli.failures import outcome_of, problem_data
from orchestrator.cli.outcome import Outcome
from orchestrator.errors import CosimError
from orchestrator.scenario.installed import scenario_path


def exported(arguments: Namespace) -> Outcome:
    """Write a scenario as a package, and tell what only nlosim reads from it."""
    try:
        path = scenario_path(arguments.scenario)
        target = arguments.output or Path(f"{path.stem}.ssp")
        found = export_scenario(path, target, arguments.version)
    except (CosimError, OSError) as error:
        return outcome_of(error)
    lines = [f"{remark} (a remark)" for remark in found.remarks]
    size = f"{found.components} components, {found.connections} connections"
    lines.append(f"{target}: SSP {arguments.version}, {size}")
    return Outcome(
        text="\n".join(lines),
        data={
            "package": str(target),
            "version": arguments.version,
            "components": found.components,
            "connections": found.connections,
            "remarks": [problem_data(each) for each in found.remarks],
        },
    )
