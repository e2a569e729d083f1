"""`--set PATH=VALUE`: values that replace or add to those of a scenario file."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from orchestrator import registry
from orchestrator.errors import ComponentTypeError, Location, Problem, ScenarioError
from orchestrator.local_module import is_reference, local_type
from orchestrator.scenario.diagnosis import show, spell
from orchestrator.scenario.document import Address, Document, Place
from orchestrator.scenario.families import KEY as FAMILY
from orchestrator.suggestion import suggestion

_ALTERNATIVES: Final = {"type": "fmu", "fmu": "type"}
"""Keys of a component of which a file has one: setting the one removes the other."""


@dataclass(frozen=True, slots=True)
class Override:
    """One override as written on the command line.

    Attributes:
        text: `components.channel.parameters.transmit_power="20 dBm"`.
    """

    text: str

    @property
    def file(self) -> str:
        """What stands for the file name in a location; the column counts within `text`."""
        return f"--set {self.text}"

    def at(self, column: int) -> Location:
        """The place of a character of `text`, counted from 1."""
        return Location(self.file, 1, column)

    def error(self, what: str, column: int = 1) -> ScenarioError:
        """`what` is wrong with this override."""
        return ScenarioError([Problem(self.at(column), what)])


def apply(document: Document, overrides: Sequence[str]) -> Document:
    """Apply overrides, the last winning over those before.

    Raises:
        ScenarioError: one problem per override that names no place in a scenario.
    """
    document, refused = attempt(document, overrides)
    stop_at(refused.values())
    return document


def attempt(
    document: Document, overrides: Sequence[str]
) -> tuple[Document, Mapping[str, Sequence[Problem]]]:
    """The document after the overrides that name a place in it, and the problems of the others."""
    refused: dict[str, Sequence[Problem]] = {}
    for text in overrides:
        try:
            document = _apply(document, Override(text))
        except ScenarioError as error:
            refused[text] = error.problems
    return document, refused


def stop_at(refused: Iterable[Sequence[Problem]]) -> None:
    """Go on only if no override is refused.

    Raises:
        ScenarioError: all problems.
    """
    problems = [problem for each in refused for problem in each]
    if problems:
        raise ScenarioError(problems)


def changed_component(override: str) -> str | None:
    """The component within which an override changes something; its family is not within it."""
    keys = override.partition("=")[0].split(".")
    return keys[1] if keys[0] == "components" and len(keys) > 2 and keys[2] != FAMILY else None


def _apply(document: Document, override: Override) -> Document:
    path, equals, value = override.text.partition("=")
    if not equals:
        raise override.error("expected PATH=VALUE, e.g. `--set time.stop=5s`")
    keys = _split(path, document)
    if not all(keys):
        raise override.error(f"`{path}` is not a path; write keys with dots, e.g. `time.stop`")
    if not value.strip():
        raise override.error("there is no value after `=`", len(override.text))
    new = Document.parse(value, override.file, offset=len(path) + 1)
    return _Edit(document, override, new).result(keys)


def _split(path: str, document: Document) -> list[str]:
    """The keys of a path.

    What follows `components.NAME.parameters.` begins with a parameter of that component's type,
    whose name may have dots; the keys after it lead into its value. If there is no such parameter,
    all of it is one name.
    """
    head, marker, rest = path.partition(".parameters.")
    if not marker:
        return path.split(".")
    keys = [*head.split("."), "parameters"]
    if "." not in rest:
        return [*keys, rest]
    declared = _declared(document, keys[:-1])
    parts = rest.split(".")
    names = [".".join(parts[:n]) for n in range(len(parts), 0, -1)]
    name = next((name for name in names if name in declared), rest)
    inner = rest[len(name) + 1 :]
    return [*keys, name, *(inner.split(".") if inner else ())]


def _declared(document: Document, address: Sequence[str]) -> Collection[str]:
    """The parameters of the type of a component; none if the type is unknown, which is found later.

    Args:
        document: with the component.
        address: of the component.
    """
    entry = document.data
    for key in address:
        entry = entry.get(key) if isinstance(entry, dict) else None
    if len(address) != 2 or address[0] != "components" or not isinstance(entry, dict):
        return ()
    name, fmu = entry.get("type"), entry.get("fmu")
    try:
        if isinstance(name, str) and is_reference(name):
            return local_type(name, document.folder((*address, "type"))).parameters
        if isinstance(name, str):
            return registry.component_type(name).parameters
        if isinstance(fmu, str):
            folder = document.folder((*address, "fmu"))
            return registry.fmu_type((folder / fmu).absolute()).parameters
    except ComponentTypeError:
        pass
    return ()


@dataclass(frozen=True, slots=True)
class _Edit:
    """A value that takes its place in a document."""

    document: Document
    override: Override
    new: Document

    def result(self, keys: Sequence[str]) -> Document:
        places = dict(self.document.places)
        data = self._inserted(self.document.data, (), keys, 1, places)
        return replace(self.document, data=data, places=places)

    def _inserted(
        self,
        data: Any,
        address: Address,
        keys: Sequence[str],
        column: int,
        places: dict[Address, Place],
    ) -> Any:
        """A copy of `data` in which the value beneath `keys` is the new one."""
        if not keys:
            self._replace_places(address, column, places)
            return self.new.data
        step = self._step(data, address, keys, column)
        here = (*address, step)
        following = column + len(keys[0]) + 1
        if isinstance(step, int):
            items = list(data)
            items[step] = self._inserted(items[step], here, keys[1:], following, places)
            return items
        entries = dict(data or {})
        if here not in places:
            places[here] = Place(self.override.at(column), self.override.at(column))
        last = column if len(keys) == 1 else following
        entries[step] = self._inserted(entries.get(step), here, keys[1:], last, places)
        if len(address) == 2 and address[0] == "components" and len(keys) == 1:
            entries.pop(_ALTERNATIVES.get(step, ""), None)
        return entries

    def _step(self, data: Any, address: Address, keys: Sequence[str], column: int) -> str | int:
        """The key or index that the first of `keys` means within `data`."""
        key = keys[0]
        if isinstance(data, list):
            if not key.isascii() or not key.isdigit() or int(key) >= len(data):
                what = f"`{key}` is not an item of {spell(address)}; items are 0 to {len(data) - 1}"
                raise self.override.error(what, column)
            return int(key)
        if data is not None and not isinstance(data, dict):
            what = f"{spell(address)} is {show(data)}, which has no `{key}` beneath it"
            raise self.override.error(what, column)
        if address == ("components",) and len(keys) > 1 and key not in (data or {}):
            what = f"there is no component `{key}`; {suggestion(key, data or {})}"
            raise self.override.error(what, column)
        return key

    def _replace_places(self, address: Address, column: int, places: dict[Address, Place]) -> None:
        for old in [a for a in places if a[: len(address)] == address]:
            del places[old]
        for inner, place in self.new.places.items():
            key = place.key if inner else self.override.at(column)
            places[(*address, *inner)] = Place(key, place.value)
