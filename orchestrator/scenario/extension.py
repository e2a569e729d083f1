"""`extends: base.yaml`: a scenario file that says only what differs from another one."""

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from orchestrator.errors import Location, Problem, ScenarioError
from orchestrator.scenario.conversion import DISTRIBUTIONS
from orchestrator.scenario.diagnosis import show
from orchestrator.scenario.document import Address, Document, Place
from orchestrator.scenario.installed import NoSuchScenarioError, scenario_beside
from orchestrator.scenario.schema import VERSION
from orchestrator.suggestion import suggestion

KEY: Final = "extends"
_ORIGINS: Final = ("type", "fmu")
"""Keys of a component that say what it is."""


def read(path: Path) -> Document:
    """The scenario file at `path`, laid over the file that it extends, if any, and so on.

    Mappings are merged key by key; anything else replaces what the base says, and so does a
    distribution of another kind. A component that gets another `type` or `fmu` loses the parameters
    that the base gave it. Every value keeps its place in the file that says it, and relative paths
    start at the folder of that file.

    Raises:
        ScenarioError: a file cannot be read or is not YAML; a base is missing, extends the file
            that extends it, or has another version; a component has no base and no type.
    """
    document = Document.read(path)
    layers = [document]
    seen = {path.resolve(): path}
    while (base := _base(layers[-1])) is not None:
        if base.resolve() in seen:
            files = " -> ".join(f"`{each.name}`" for each in (*seen.values(), base))
            raise _error(layers[-1].value((KEY,)), f"{KEY}: this is a circle: {files}")
        seen[base.resolve()] = base
        layers.append(_read_base(base))
    merged = layers.pop()
    while layers:
        merged = overlaid(merged, layers.pop())
    return merged


def _base(document: Document) -> Path | None:
    """The path of the file that `document` extends."""
    if not isinstance(document.data, dict) or KEY not in document.data:
        return None
    name, where = document.data[KEY], document.value((KEY,))
    if not isinstance(name, str) or not name:
        raise _error(where, f"{KEY}: expected the path of a scenario file, got {show(name)}")
    try:
        return scenario_beside(document.folder((KEY,)), name)
    except NoSuchScenarioError as error:
        raise _error(where, f"{KEY}: {error}") from None


def _read_base(path: Path) -> Document:
    document = Document.read(path)
    if not isinstance(document.data, dict):
        what = f"expected a mapping of `key: value` lines, got {show(document.data)}"
        raise _error(document.value(()), what)
    version = document.data.get("schema")
    if type(version) is not int or version != VERSION:
        what = f"schema: expected `{VERSION}`, got {show(version)}"
        raise _error(document.value(("schema",)), what)
    return document


def overlaid(base: Document, overlay: Document) -> Document:
    """`overlay` with what it leaves open taken from `base`.

    Raises:
        ScenarioError: the overlay changes components that the base does not have.
    """
    merging = _Merging(base, overlay)
    data = merging.merged(base.data, overlay.data, ())
    if merging.problems:
        raise ScenarioError(merging.problems)
    data.pop(KEY, None)
    places = {**merging.kept_places(), **overlay.places}
    places.pop((KEY,), None)
    return replace(
        overlay,
        data=data,
        places=places,
        folders={**base.folders, **overlay.folders},
    )


class _Merging:
    """One walk over two documents, noting what of the base is lost.

    Attributes:
        problems: components that neither document makes a component.
    """

    def __init__(self, base: Document, overlay: Document) -> None:
        self._base = base
        self._overlay = overlay
        self._lost: set[Address] = set()
        self.problems: list[Problem] = []

    def merged(self, base: Any, overlay: Any, address: Address) -> Any:
        """The value at `address`."""
        is_merged = isinstance(base, dict) and isinstance(overlay, dict)
        if not is_merged or (len(address) > 3 and _is_other_distribution(base, overlay)):
            self._lost.add(address)
            return overlay
        if address == ("components",):
            self._check_names(base, overlay)
        kept = {key: base[key] for key in base if key not in self._dropped(base, overlay, address)}
        self._lost |= {(*address, key) for key in base if key not in kept}
        over = {
            key: self.merged(kept[key], value, (*address, key)) if key in kept else value
            for key, value in overlay.items()
        }
        return {**kept, **over}

    def _check_names(self, base: Mapping[str, Any], overlay: Mapping[str, Any]) -> None:
        """A new component says what it is; one that does not is a slip of the pen."""
        for name, entry in overlay.items():
            if name in base or not isinstance(entry, dict) or set(_ORIGINS) & set(entry):
                continue
            what = f"there is no component `{name}` to change; {suggestion(name, base)}"
            where = self._overlay.key(("components", name))
            self.problems.append(Problem(where, f"components: {what}"))

    def _dropped(
        self, base: Mapping[str, Any], overlay: Mapping[str, Any], address: Address
    ) -> set[str]:
        """Keys of the base that mean nothing beneath the overlay."""
        if not address:
            return {KEY, "schema"}  # each file says these of itself
        is_component = len(address) == 2 and address[0] == "components"
        if not is_component or not set(_ORIGINS) & set(overlay):
            return set()
        before, after = (self._origin(d, address) for d in (self._base, self._overlay))
        return {*_ORIGINS} if before == after else {*_ORIGINS, "parameters"}

    def _origin(self, document: Document, address: Address) -> tuple[object, ...]:
        """What says which type a component has; paths to one file are equal."""
        data = document.data["components"][address[1]]
        fmu = data.get("fmu")
        if isinstance(fmu, str):
            fmu = os.path.normpath((document.folder((*address, "fmu")) / fmu).absolute())
        return data.get("type"), fmu

    def kept_places(self) -> dict[Address, Place]:
        """The places of what `merged` has left of the base."""
        return {
            address: place
            for address, place in self._base.places.items()
            if not any(address[:n] in self._lost for n in range(len(address) + 1))
        }


def _is_other_distribution(base: Mapping[str, Any], overlay: Mapping[str, Any]) -> bool:
    """Whether both are distributions, `{uniform: ...}` and `{normal: ...}`, of unequal kinds."""
    words = [set(each) for each in (base, overlay)]
    return words[0] != words[1] and all(len(w) == 1 and w <= {*DISTRIBUTIONS} for w in words)


def _error(where: Location, what: str) -> ScenarioError:
    return ScenarioError([Problem(where, what)])
