"""`nlosim ssp import`."""

from argparse import Namespace
from fractions import Fraction
from pathlib import Path

from adapters.ssp.importing import Imported, import_package
from adapters.ssp.times import Wanted
from orchestrator.cli.failures import outcome_of, problem_data
from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.errors import CosimError
from orchestrator.exact import quotient


def imported(arguments: Namespace) -> Outcome:
    """Write the scenario of a package, and tell what does not fit or is left out."""
    try:
        wanted = Wanted(stop=_seconds(arguments.stop_time), step=_seconds(arguments.step))
    except ValueError as error:
        return failure("ssp", Exit.WRONG_INPUT, str(error))
    folder = arguments.output or Path(arguments.path.stem)
    try:
        found = import_package(
            arguments.path,
            folder,
            variant=arguments.system,
            wanted=wanted,
            trusts_numbers=arguments.trust_numbers,
        )
    except (CosimError, OSError) as error:
        return outcome_of(error)
    return _told(found)


def _seconds(text: str | None) -> Fraction | None:
    """A number of seconds, which may be a fraction such as `1/60`."""
    if text is None:
        return None
    try:
        return quotient(text)
    except ZeroDivisionError:
        raise ValueError(f"`{text}` divides by 0") from None


def _told(found: Imported) -> Outcome:
    lines = [f"{remark} (a remark)" for remark in found.remarks]
    size = f"{found.components} components, {found.connections} connections"
    lines.append(f"{found.path}: {size}")
    if found.obstacles:
        lines += ["it cannot run as it is:", *map(str, found.obstacles)]
    else:
        lines.append(f"run it: nlosim run {found.path}")
    return Outcome(
        text="\n".join(lines),
        data={
            "scenario": str(found.path),
            "components": found.components,
            "connections": found.connections,
            "remarks": [problem_data(each) for each in found.remarks],
            "obstacles": [problem_data(each) for each in found.obstacles],
        },
        exit_code=Exit.NOT_PASSED if found.obstacles else Exit.DONE,
    )
