"""The input files of a scenario: what is wrong with them, and their digests."""

from collections.abc import Container, Iterable, Iterator, Mapping
from pathlib import Path

from orchestrator.errors import (
    ComponentError,
    ComponentTypeError,
    CosimError,
    Problem,
    ScenarioError,
    defects,
    in_words,
)
from orchestrator.input_files import FileCheck, digest, named_files
from orchestrator.scenario.document import Document
from orchestrator.scenario.model import ComponentUse, Scenario
from orchestrator.scenario.path_values import plug_in_values
from orchestrator.scenario.wiring import located, refusals


def check_inputs(
    scenario: Scenario, *, thorough: bool, without: Container[str] = ()
) -> list[Problem]:
    """Check the input files of every component.

    Args:
        scenario: as `load_scenario` returns it.
        thorough: as in `FileReadingComponent.check_files`.
        without: components whose files are elsewhere.

    Returns:
        Remarks, in the order of the files.

    Raises:
        ScenarioError: all problems, each at its place in an input file or in the scenario.
        ComponentError: a component cannot check its files, for a reason of its own.
    """
    problems: set[Problem] = set()
    remarks: set[Problem] = set()
    for name, use in _here(scenario, without):
        address = ("components", name, "parameters")
        found = _check(scenario.document, use, thorough=thorough)
        problems.update(located(scenario.document, address, found.problems))
        remarks.update(located(scenario.document, address, found.remarks))
    if problems:
        raise ScenarioError(_ordered(problems))
    return _ordered(remarks)


def digests(scenario: Scenario, without: Container[str] = ()) -> Mapping[str, Mapping[str, str]]:
    """SHA-256 of every file that is read, but for those of components in `without`.

    Returns:
        By component, `measures.NAME` or `report`, hexadecimal digests by path: relative to the
        folder of the scenario file for files in it, absolute for others. Who reads no file is left
        out.
    """
    folder = scenario.path.absolute().parent
    known: dict[Path, str] = {}
    found: dict[str, dict[str, str]] = {}
    readers = {name: _files(use) for name, use in _here(scenario, without)}
    readers |= {name: named_files(said) for name, said in plug_in_values(scenario).items()}
    for name, files in readers.items():
        for path in files:
            known[path] = known.get(path) or digest(path)
            found.setdefault(name, {})[shown(path, folder)] = known[path]
    return found


def scenario_digests(scenario: Scenario) -> Mapping[str, str]:
    """SHA-256 of the scenario file and of those that it extends, by path as in `digests`."""
    folder = scenario.path.absolute().parent
    files = [Path(name) for name in (str(scenario.path), *scenario.document.folders)]
    return {shown(path, folder): digest(path) for path in files if path.is_file()}


def _here(scenario: Scenario, without: Container[str]) -> Iterator[tuple[str, ComponentUse]]:
    return ((name, use) for name, use in scenario.components.items() if name not in without)


def _check(document: Document, use: ComponentUse, *, thorough: bool) -> FileCheck:
    try:
        return use.type.check_files(use.values, thorough=thorough)
    except (ComponentTypeError, ValueError) as error:
        return FileCheck(problems=tuple(refusals(document, use, error)))
    except CosimError:
        raise
    except defects() as error:  # anything else is a defect of the component
        reason = f"cannot check its files: {in_words(error)}"
        raise ComponentError(use.name, None, reason) from error


def _files(use: ComponentUse) -> Iterable[Path]:
    try:
        return use.type.input_files(use.all_values())
    except CosimError:
        raise
    except defects() as error:  # a defect of the component
        reason = f"cannot name its files: {in_words(error)}"
        raise ComponentError(use.name, None, reason) from error


def _ordered(problems: Iterable[Problem]) -> list[Problem]:
    return sorted(problems, key=lambda problem: (problem.where, problem.what))


def shown(path: Path, folder: Path) -> str:
    """A path relative to `folder` if it is in it, else the whole."""
    path = path.absolute()
    return (path.relative_to(folder) if path.is_relative_to(folder) else path).as_posix()
