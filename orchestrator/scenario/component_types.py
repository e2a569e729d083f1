"""The types of components: what `type` and `fmu` in a scenario name."""

from pathlib import Path

from orchestrator import registry
from orchestrator.local_module import file_of, is_reference, local_type
from orchestrator.parameters import ComponentType


def module_of(name: str | None, folder: Path) -> Path | None:
    """The file of a type that is named by a class in it."""
    return file_of(name, folder) if name is not None and is_reference(name) else None


def type_of(name: str | None, fmu: Path | None, folder: Path) -> ComponentType:
    """The type of a component.

    Args:
        name: of an installed type, or a class in a file; `None` if there is an FMU.
        fmu: the path of the FMU, or `None`.
        folder: where relative names of files start.

    Raises:
        ComponentTypeError: it is not there, or cannot be loaded.
    """
    if fmu is not None:
        return registry.fmu_type(fmu)
    assert name is not None  # noqa: S101 - one of the two is given, checked by the caller
    if is_reference(name):
        return local_type(name, folder)
    return registry.component_type(name)
