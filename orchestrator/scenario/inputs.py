"""The input files of a scenario: what is wrong with them, and their digests."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from orchestrator.errors import (
    ComponentError,
    ComponentTypeError,
    CosimError,
    Problem,
    ScenarioError,
)
from orchestrator.input_files import FileCheck, digest
from orchestrator.scenario.document import Document
from orchestrator.scenario.model import ComponentUse, Scenario
from orchestrator.scenario.wiring import located, refusals


def check_inputs(scenario: Scenario, *, thorough: bool) -> list[Problem]:
    """Check the input files of every component.

    Args:
        scenario: as `load_scenario` returns it.
        thorough: as in `FileReadingComponent.check_files`.

    Returns:
        Remarks, in the order of the files.

    Raises:
        ScenarioError: all problems, each at its place in an input file or in the scenario.
        ComponentError: a component cannot check its files, for a reason of its own.
    """
    problems: set[Problem] = set()
    remarks: set[Problem] = set()
    for name, use in scenario.components.items():
        address = ("components", name, "parameters")
        found = _check(scenario.document, use, thorough=thorough)
        problems.update(located(scenario.document, address, found.problems))
        remarks.update(located(scenario.document, address, found.remarks))
    if problems:
        raise ScenarioError(_ordered(problems))
    return _ordered(remarks)


def digests(scenario: Scenario) -> Mapping[str, Mapping[str, str]]:
    """SHA-256 of every file that the components read.

    Returns:
        By component, hexadecimal digests by path: relative to the folder of the scenario file for
        files in it, absolute for others. Components that read no file are left out.
    """
    folder = scenario.path.absolute().parent
    known: dict[Path, str] = {}
    found: dict[str, dict[str, str]] = {}
    for name, use in scenario.components.items():
        for path in _files(use):
            known[path] = known.get(path) or digest(path)
            found.setdefault(name, {})[_shown(path, folder)] = known[path]
    return found


def _check(document: Document, use: ComponentUse, *, thorough: bool) -> FileCheck:
    try:
        return use.type.check_files(use.values, thorough=thorough)
    except (ComponentTypeError, ValueError) as error:
        return FileCheck(problems=tuple(refusals(document, use, error)))
    except CosimError:
        raise
    except Exception as error:  # anything else is a defect of the component
        reason = f"cannot check its files: {type(error).__name__}: {error}"
        raise ComponentError(use.name, None, reason) from error


def _files(use: ComponentUse) -> Iterable[Path]:
    try:
        return use.type.input_files(use.all_values())
    except CosimError:
        raise
    except Exception as error:  # a defect of the component
        reason = f"cannot name its files: {type(error).__name__}: {error}"
        raise ComponentError(use.name, None, reason) from error


def _ordered(problems: Iterable[Problem]) -> list[Problem]:
    return sorted(problems, key=lambda problem: (problem.where, problem.what))


def _shown(path: Path, folder: Path) -> str:
    path = path.absolute()
    return (path.relative_to(folder) if path.is_relative_to(folder) else path).as_posix()
