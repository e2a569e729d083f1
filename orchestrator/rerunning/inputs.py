"""Finding again what a run read, by name and digest."""

import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from orchestrator.input_files import digest
from orchestrator.manifest import ANYWHERE, FOLDER, PACKAGES, PATHS
from orchestrator.scenario.document import Address
from orchestrator.scenario.installed import installed

_MOST: Final = 20_000
"""Files that are looked at in the folder of `--inputs`."""


@dataclass(frozen=True, slots=True)
class Found:
    """What became of the paths of a manifest.

    Attributes:
        texts: what the resolved scenario is to say in place of each, by address.
        missing: each that is not here, as a sentence.
        changed: each that is here with another content, as a sentence.
    """

    texts: Mapping[Address, str]
    missing: Sequence[str]
    changed: Sequence[str]


def found_inputs(manifest: Mapping[str, Any], inputs: Path | None) -> Found:
    """Look for the paths of a manifest.

    A file is taken whose content is that of then: in `inputs` where it was relative to the
    scenario, else any of its name, else any of its suffix; then where it was, and among
    installed packages.

    Args:
        manifest: of the run.
        inputs: a folder; `None`: as recorded.
    """
    search = _Search(inputs, _folders(manifest))
    texts: dict[Address, str] = {}
    missing, changed = [], []
    for each in manifest[PATHS]:
        named = f"`{each['path']}`, which `{each['reader']}` reads,"
        path = search.path(each)
        if path is None:
            missing.append(f"{named} is missing")
            continue
        texts[tuple(each["at"])] = f"{path}{each.get('rest', '')}"
        if each["sha256"] is not None and digest(path) != each["sha256"]:
            changed.append(f"{named} has another content")
    return Found(texts, missing, changed)


def other_files(
    then: Mapping[str, Mapping[str, str]], now: Mapping[str, Mapping[str, str]]
) -> tuple[list[str], list[str]]:
    """What readers read now that is not what they read then; where files are does not matter.

    Args:
        then: digests by path, by reader.
        now: likewise.

    Returns:
        Files that are missing, and files that have another content or were not there, as sentences.
    """
    missing, changed = [], []
    for reader in dict.fromkeys((*then, *now)):
        before, after = dict(then.get(reader, {})), dict(now.get(reader, {}))
        for path, content in [*before.items()]:
            same = next((name for name, other in after.items() if other == content), None)
            if same is not None:
                del before[path], after[same]
        for path in before:
            named = f"`{path}`, which `{reader}` reads,"
            other = next((name for name in after if _name(name) == _name(path)), None)
            if other is None:
                missing.append(f"{named} is missing")
            else:
                del after[other]
                changed.append(f"{named} has another content")
        changed += [f"`{path}`, which `{reader}` reads, was not read then" for path in after]
    return missing, changed


def _name(path: str) -> str:
    """The name of a file; of two of one name, a private manifest numbers the second."""
    return path.rpartition("/")[2].split(" (")[0]


def _folders(manifest: Mapping[str, Any]) -> list[Path]:
    """Where the scenario was, and where an installed one of its name is."""
    file = Path(str(manifest.get("scenario_file", "")))
    offers = installed().get(str(manifest.get("installed", "")), ())
    return [*([file.parent] if file.is_absolute() else []), *(each.path.parent for each in offers)]


@dataclass(slots=True)
class _Search:
    """A look at folders, which reads no file twice."""

    inputs: Path | None
    folders: Sequence[Path]
    digests: dict[Path, str] = field(default_factory=dict)
    files: list[Path] | None = None

    def path(self, entry: Mapping[str, Any]) -> Path | None:
        """Where the path of an entry of the manifest is; of the same content if there is any."""
        places = [each for each in self._places(entry) if each.exists()]
        wanted = entry["sha256"]
        if wanted is None:
            return next(iter(places), None)
        near = [each for each in places if each.is_file()]
        for each in (*near, *self._alike(Path(entry["path"]))):
            if self._digest(each) == wanted:
                return each
        return next(iter(near), None)

    def _places(self, entry: Mapping[str, Any]) -> Iterator[Path]:
        """Where it should be."""
        name = entry["path"]
        if self.inputs is not None and not Path(name).is_absolute():
            yield (self.inputs / name).absolute()
        if self.inputs is not None:
            yield (self.inputs / Path(name).name).absolute()
        match entry["from"]:
            case start if start == FOLDER:
                yield from ((folder / name).absolute() for folder in self.folders)
            case start if start == PACKAGES:
                yield from ((Path(each) / name).absolute() for each in sys.path if each)
            case start if start == ANYWHERE and Path(name).is_absolute():
                yield Path(name)

    def _alike(self, path: Path) -> Iterator[Path]:
        """Files in the folder of `--inputs` that it might be: first those of its name."""
        if self.files is None:
            self.files = [] if self.inputs is None else list(_files(self.inputs.absolute()))
        yield from (each for each in self.files if each.name == path.name)
        yield from (each for each in self.files if each.suffix == path.suffix)

    def _digest(self, path: Path) -> str:
        if path not in self.digests:
            self.digests[path] = digest(path)
        return self.digests[path]


def _files(folder: Path) -> Iterator[Path]:
    """The files in a folder, in the order of their names, and no more than `_MOST`."""
    count = 0
    for place, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            path = Path(place) / name
            if path.is_file():
                yield path
                count += 1
            if count == _MOST:
                return
