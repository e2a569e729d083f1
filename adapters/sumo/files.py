"""The files of a SUMO scene: what its configuration names, and what these files name in turn."""

import enum
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

from typing_extensions import override

from adapters.sumo.checks.configuration import Setting, read_configuration
from adapters.sumo.checks.options import time
from adapters.sumo.checks.reading import Attributes, Elements, mentions, read
from orchestrator.errors import Location, Problem
from orchestrator.input_files import digest
from orchestrator.timebase import Duration, Time


class FileKind(enum.Enum):
    """What an input file is read as."""

    NET = "a net"
    ROUTES = "a route file"
    ADDITIONAL = "an additional file"
    DATA = "data"


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedFile:
    """A file that another file names.

    Attributes:
        path: of the file.
        kind: what SUMO reads it as; of an output, `None`.
        named_by: the option, or the element and its attribute.
        where: the place that names it.
    """

    path: Path
    kind: FileKind | None
    named_by: str
    where: Location


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneFiles:
    """What a SUMO configuration says.

    Attributes:
        config: the configuration (`*.sumocfg`).
        inputs: every file that SUMO reads, in its order: net, additional files, routes, others; a
            file stands before those that it names itself.
        outputs: every file that SUMO would write, as options and additional files name them.
        settings: all options by their full names, those of files included.
    """

    config: Path
    inputs: tuple[NamedFile, ...]
    outputs: tuple[NamedFile, ...]
    settings: Mapping[str, Setting]

    @property
    def net(self) -> Path | None:
        """The net; `None` if the configuration names none."""
        return next(iter(self._of(FileKind.NET)), None)

    @property
    def routes(self) -> tuple[Path, ...]:
        """The route files, included ones too."""
        return self._of(FileKind.ROUTES)

    @property
    def additionals(self) -> tuple[Path, ...]:
        """The additional files, included ones too."""
        return self._of(FileKind.ADDITIONAL)

    @property
    def begin(self) -> Time | None:
        """When the simulation begins [ns]; `None` if the configuration is silent."""
        return self._time("begin")

    @property
    def end(self) -> Time | None:
        """When the simulation ends [ns]; `None` if it is silent or sets no end (-1)."""
        end = self._time("end")
        return None if end is None or end < 0 else end

    @property
    def step_length(self) -> Duration | None:
        """The step of the simulation [ns]; `None` if the configuration is silent."""
        return self._time("step-length")

    @property
    def seed(self) -> int | None:
        """The seed of SUMO's random numbers; `None` if the configuration is silent."""
        text = self.settings["seed"].value if "seed" in self.settings else ""
        return int(text) if text.removeprefix("-").isdecimal() else None

    @property
    def reads_routes_in_parts(self) -> bool:
        """Whether SUMO reads route files while it simulates: unless `route-steps` is 0 or less."""
        steps = self._time("route-steps")
        return steps is None or steps > 0

    def is_on(self, option: str) -> bool:
        """Whether a switch is set."""
        text = self.settings[option].value if option in self.settings else ""
        return text.strip().lower() in {"true", "1", "yes", "on", "t"}

    def paths(self) -> tuple[Path, ...]:
        """The configuration and every input file that exists, each once."""
        named = (each.path for each in self.inputs)
        return tuple(dict.fromkeys([self.config, *(path for path in named if path.is_file())]))

    def digests(self) -> Mapping[str, str]:
        """SHA-256 of the configuration and of every input file that exists, as they are stored.

        Returns:
            Hexadecimal digests by path, relative to the folder of the configuration.
        """
        folder = self.config.parent
        return MappingProxyType({_relative(path, folder): digest(path) for path in self.paths()})

    def _of(self, kind: FileKind) -> tuple[Path, ...]:
        return tuple(each.path for each in self.inputs if each.kind is kind)

    def _time(self, option: str) -> Time | None:
        return time(self.settings[option].value) if option in self.settings else None


_KINDS: Final = MappingProxyType(
    {
        "net-file": FileKind.NET,
        "additional-files": FileKind.ADDITIONAL,
        "route-files": FileKind.ROUTES,
    }
)
"""What the files of an option are read as, in the order in which SUMO reads them."""

_READ: Final = MappingProxyType(
    {"rerouter": ("file",), "variableSpeedSign": ("file",), "calibrator": ("file",)}
)
"""Elements of additional files that name a file to be read, and the attribute that does."""

_WRITTEN: Final = MappingProxyType(
    {
        **dict.fromkeys(("edgeData", "laneData", "inductionLoop", "e1Detector"), ("file",)),
        **dict.fromkeys(("laneAreaDetector", "e2Detector"), ("file",)),
        **dict.fromkeys(("entryExitDetector", "e3Detector"), ("file",)),
        **dict.fromkeys(("instantInductionLoop", "routeProbe", "vTypeProbe"), ("file",)),
        "calibrator": ("output",),
        "timedEvent": ("dest",),
    }
)
"""Elements of additional files that name a file to be written, and the attribute that does."""

_NOWHERE: Final = frozenset({"NUL", "/dev/null", "stdout", "stderr", "-"})
"""Outputs with these names make no file."""


def read_scene(config: Path) -> tuple[SceneFiles, list[Problem]]:
    """Read a configuration, and from the files that it names which others they name.

    Args:
        config: the configuration (`*.sumocfg`); paths in it are relative to its folder.

    Returns:
        What could be read, and the problems: syntax of the configuration and of additional files,
        options that SUMO does not know or whose values it cannot take, files that do not exist or
        that include themselves.
    """
    settings, problems = read_configuration(config)
    walk = _Walk(problems)
    ordered = sorted(settings.values(), key=_turn)
    for setting in ordered:
        walk.follow(setting, config.parent)
    if "net-file" not in settings and not problems:
        what = 'the configuration names no net; add `<net-file value="..."/>` to `<input>`'
        problems.append(Problem(Location(str(config), 1, 1), what))
    scene = SceneFiles(
        config=config,
        inputs=tuple(walk.inputs),
        outputs=tuple(walk.outputs),
        settings=MappingProxyType(settings),
    )
    return scene, problems


def _turn(setting: Setting) -> int:
    """When SUMO reads the files of an option."""
    order = list(_KINDS)
    return order.index(setting.option.name) if setting.option.name in order else len(order)


class _Walk:
    """Collects files as they name each other."""

    def __init__(self, problems: list[Problem]) -> None:
        self.inputs: list[NamedFile] = []
        self.outputs: list[NamedFile] = []
        self._problems = problems

    def follow(self, setting: Setting, folder: Path) -> None:
        """What an option names, and what these files name."""
        if setting.option.is_output and setting.value not in _NOWHERE:
            self.outputs.append(
                NamedFile(
                    path=resolved(folder, setting.value),
                    kind=None,
                    named_by=setting.option.name,
                    where=setting.where,
                )
            )
        if setting.option.is_input:
            kind = _KINDS.get(setting.option.name, FileKind.DATA)
            for name in filter(None, map(str.strip, setting.value.split(","))):
                self._input(resolved(folder, name), kind, setting.option.name, setting.where, ())

    def _input(
        self, path: Path, kind: FileKind, named_by: str, where: Location, above: tuple[Path, ...]
    ) -> None:
        if "${" in str(path):
            what = f"`{named_by}`: {path.name} depends on an environment variable; write the path"
            self._problems.append(Problem(where, what))
            return
        if path in above:
            self._problems.append(Problem(where, f"`{named_by}`: {path} includes itself"))
            return
        self.inputs.append(NamedFile(path=path, kind=kind, named_by=named_by, where=where))
        if not path.is_file():
            reason = "is a folder" if path.is_dir() else "does not exist"
            self._problems.append(Problem(where, f"`{named_by}`: the file {path} {reason}"))
            return
        if kind is FileKind.DATA or (
            kind is not FileKind.ADDITIONAL and not mentions(path, _INCLUDE)
        ):
            return
        names = _Names(path.parent)
        self._problems += read(path, names)
        self.outputs += names.outputs
        for each in names.inputs:
            inner = FileKind.DATA if each.kind is FileKind.DATA else kind
            self._input(each.path, inner, each.named_by, each.where, (*above, path))


class _Names(Elements):
    """The files that a file names."""

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self._folder = folder
        self.inputs: list[NamedFile] = []
        self.outputs: list[NamedFile] = []

    @override
    def start(self, name: str, attributes: Attributes) -> None:
        if name == "include":
            self._add(self.inputs, name, "href", attributes, None)
        for attribute in _READ.get(name, ()):
            self._add(self.inputs, name, attribute, attributes, FileKind.DATA)
        for attribute in _WRITTEN.get(name, ()):
            if attributes.get(attribute) not in _NOWHERE:
                self._add(self.outputs, name, attribute, attributes, None)

    def _add(
        self,
        found: list[NamedFile],
        element: str,
        attribute: str,
        attributes: Attributes,
        kind: FileKind | None,
    ) -> None:
        name = attributes.get(attribute, "")
        if name:
            found.append(
                NamedFile(
                    path=resolved(self._folder, name),
                    kind=kind,
                    named_by=f"{element} {attribute}",
                    where=self._here(),
                )
            )


def resolved(folder: Path, name: str) -> Path:
    """The path of a file that is named relative to `folder`, without `..` where it can be."""
    return Path(os.path.normpath(folder / name))


_INCLUDE: Final = b"<include"


def _relative(path: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # on another drive
        return path.as_posix()
