"""Component types: what can be instantiated, and with which parameters.

A Python component declares its parameters as a frozen dataclass called `Parameters` nested
in its class, whose constructor takes one instance of it:

    class Trace(Component):
        '''Replays a recorded trace.'''

        @dataclass(frozen=True, slots=True, kw_only=True)
        class Parameters:
            file: Path = parameter(doc="CSV file with one row per sample")
            gain: float = parameter(3.0, unit="dB", doc="added to every sample")

        def __init__(self, parameters: Parameters) -> None: ...

A parameter may have structure: its type may be a record, which is again a frozen dataclass whose
fields are made by `parameter`, `tuple[Record, ...]`, or `Mapping[str, Record]`; the mapping that
the component receives is read-only and has the order of the file. `Record | None` takes `null`,
also in a list or by name. `Distribution` and `DistributedText` (`orchestrator.distribution`) are
values that the component draws.

Such a class is offered to scenarios by an entry point in the group
`orchestrator.components`. Other sources of components (FMUs) implement `ComponentType`.
"""

import abc
import dataclasses
import enum
import sys
import typing
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, cast

from typing_extensions import override

from orchestrator.caution import Caution
from orchestrator.component import (
    Component,
    DecidingComponent,
    ForeseenComponent,
    OncePerProcessComponent,
)
from orchestrator.errors import ParameterProblem
from orchestrator.input_files import FileCheck, FileReadingComponent, named_files
from orchestrator.kinds import FrozenMapping
from orchestrator.output_files import FileWritingComponent
from orchestrator.signal import Connector
from orchestrator.timebase import StepSize
from orchestrator.units import Unit

REQUIRED: Final = dataclasses.MISSING
"""The default of a parameter that a scenario must set."""


class _Drawn(enum.Enum):
    DRAWN = "drawn"


DRAWN: Final = _Drawn.DRAWN
"""The default of a seed: the component draws it from its own random stream."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """What a component type says about one parameter.

    Attributes:
        type: `bool`, `int`, `float`, `str`, `pathlib.Path` (relative to the scenario
            file), `str | Path` (`orchestrator.kinds.FILE_OR_NAME`), a `typing.Literal` of strings,
            `Distribution`, `DistributedText` or a record; `tuple[T, ...]` or `Mapping[str, T]` of
            one of these; and `T | None`.
        unit: the unit of the value the component receives; scenario files may write any
            unit of the same quantity. `"1"` for pure numbers and for text.
        definition: what the unit is, if it is not in the table of units, or something else there.
        is_relative: whether the value is a difference, so that conversions leave the offset of its
            unit out (FMI: `relativeQuantity`).
        default: the value when the scenario is silent, or `REQUIRED`, or `DRAWN`.
        minimum, maximum: inclusive bounds of numbers, and of all that a distribution may
            draw, in `unit`.
        doc: one sentence.
        is_optional: whether the component behaves as usual without it, so that resolved scenarios
            do not write its default out.
        caution: a value that biases results, of which the summary of a run warns.
        names: of what is installed, for `str | Path`; a file that has another one is refused.
            `None`: the component knows them.
    """

    type: Any
    unit: str = "1"
    definition: Unit | None = None
    is_relative: bool = False
    default: Any = REQUIRED
    minimum: float | None = None
    maximum: float | None = None
    doc: str = ""
    is_optional: bool = False
    caution: Caution | None = None
    names: Callable[[], Sequence[str]] | None = None


class Parametrised:
    """A plug-in whose parameters are the fields of a frozen dataclass, each made by `parameter`."""

    def problems(self, components: Sequence[str]) -> Iterator[ParameterProblem]:
        """Everything wrong with the parameters in a system of `components`, by their names.

        Asked for before any component exists.
        """
        del components
        yield from ()


class ComponentType(abc.ABC):
    """Something a scenario can instantiate."""

    @property
    @abc.abstractmethod
    def description(self) -> str:
        """One sentence for `nlosim components`."""

    @property
    @abc.abstractmethod
    def parameters(self) -> Mapping[str, Parameter]:
        """The parameters on offer, by name."""

    @property
    def decides(self) -> bool:
        """Whether instances are `DecidingComponent`s."""
        return False

    def foreseen_connectors(self) -> Mapping[str, Connector] | None:
        """The connectors of any instance, `<word>` for names that parameters give.

        `None`, the default: they are known once the parameters are.
        """
        return None

    def once_per_process(self, values: Mapping[str, Any]) -> str | None:
        """What an instance holds of which a process can have only one, such as `SUMO`.

        Two instances, of whatever types, that hold the same cannot be in one process.

        Args:
            values: as for `create`.

        Returns:
            A name for messages; `None`, the default, if instances can be in one process.
        """
        del values
        return None

    def step_problem(
        self, step: StepSize, values: Mapping[str, Any] = MappingProxyType({})
    ) -> str | None:
        """Why an instance cannot be stepped with this communication step size.

        Args:
            step: [ns].
            values: as for `create`.

        Returns:
            What is wrong with it, as a predicate; `None`, the default, if nothing is.
        """
        del step, values
        return None

    def manner(self, values: Mapping[str, Any]) -> str:
        """How an instance works, where that is worth a word, e.g. with which solver.

        Args:
            values: as for `create`.

        Returns:
            A few words for `nlosim check` and `graph`; nothing, by default.
        """
        del values
        return ""

    def input_files(self, values: Mapping[str, Any]) -> tuple[Path, ...]:
        """Every file that an instance reads, each once; `values` as for `create`."""
        return tuple(dict.fromkeys(named_files(values)))

    def check_files(self, values: Mapping[str, Any], *, thorough: bool) -> FileCheck:
        """What is found in these files; see `FileReadingComponent.check_files`."""
        del values, thorough
        return FileCheck()

    def output_files(self, values: Mapping[str, Any]) -> tuple[Path, ...]:
        """Every file that an instance writes; relative paths are in the directory of the run.

        Args:
            values: as for `create`.
        """
        del values
        return ()

    @property
    def sources(self) -> Mapping[str, Path]:
        """Files with its code that are no input files, by the name of their module."""
        return MappingProxyType({})

    @abc.abstractmethod
    def create(self, name: str, values: Mapping[str, Any]) -> Component:
        """Create an instance called `name`.

        Args:
            name: the instance name, for log messages.
            values: parameter values in the declared type and unit; missing ones take
                their defaults. All required ones are present.

        Raises:
            ComponentTypeError: the values do not fit together.
        """


def parameter(
    default: Any = REQUIRED,
    *,
    unit: str = "1",
    minimum: float | None = None,
    maximum: float | None = None,
    doc: str,
    caution: Caution | None = None,
    names: Callable[[], Sequence[str]] | None = None,
) -> Any:
    """A dataclass field that declares a parameter; see the module docstring."""
    if isinstance(default, Mapping):
        default = FrozenMapping(default)
    bounds = {"minimum": minimum, "maximum": maximum}
    metadata = {"unit": unit, **bounds, "doc": doc, "caution": caution, "names": names}
    return dataclasses.field(default=default, metadata=metadata)


def declared(record: type) -> Mapping[str, Parameter]:
    """The parameters that a dataclass declares by its fields, each made with `parameter`.

    A class that is none, such as a report without parameters, declares nothing.
    """
    return _declared(cast("Hashable", record))


@lru_cache(maxsize=256)
def _declared(record: Any) -> Mapping[str, Parameter]:
    if not dataclasses.is_dataclass(record):
        return MappingProxyType({})
    hints = typing.get_type_hints(record)
    return MappingProxyType(
        {
            field.name: Parameter(type=hints[field.name], default=field.default, **field.metadata)
            for field in dataclasses.fields(record)
        }
    )


def description(described: type) -> str:
    """The first line of the docstring of a class; empty if nobody wrote one."""
    text = (described.__doc__ or "").strip().split("\n", 1)[0]
    is_made_by_dataclass = text.startswith(f"{described.__name__}(")
    return "" if is_made_by_dataclass else text


class PythonComponentType(ComponentType):
    """The type of a `Component` subclass with a nested `Parameters` dataclass.

    Args:
        component: the class.
        files: that it is read from, where they are files of the user.
    """

    def __init__(self, component: type[Component], files: tuple[Path, ...] = ()) -> None:
        self._component = component
        self._files = files
        self._record: Any = getattr(component, "Parameters", None)

    @property
    @override
    def description(self) -> str:
        return description(self._component)

    @property
    @override
    def parameters(self) -> Mapping[str, Parameter]:
        return MappingProxyType({}) if self._record is None else declared(self._record)

    @property
    @override
    def decides(self) -> bool:
        return issubclass(self._component, DecidingComponent)

    @property
    @override
    def sources(self) -> Mapping[str, Path]:
        module = sys.modules.get(self._component.__module__)
        file = getattr(module, "__file__", None)
        if self._files or file is None:
            return MappingProxyType({})
        return MappingProxyType({self._component.__module__: Path(file)})

    @override
    def foreseen_connectors(self) -> Mapping[str, Connector] | None:
        if issubclass(self._component, ForeseenComponent):
            return self._component.foreseen_connectors()
        found: Any = self._component.connectors
        return found if isinstance(found, Mapping) else None

    @override
    def once_per_process(self, values: Mapping[str, Any]) -> str | None:
        if not issubclass(self._component, OncePerProcessComponent):
            return None
        return self._component.once_per_process(self._record(**values))

    @override
    def input_files(self, values: Mapping[str, Any]) -> tuple[Path, ...]:
        named = (*self._files, *named_files(values))
        if issubclass(self._component, FileReadingComponent):
            named += tuple(self._component.input_files(self._record(**values)))
        return tuple(dict.fromkeys(named))

    @override
    def check_files(self, values: Mapping[str, Any], *, thorough: bool) -> FileCheck:
        if not issubclass(self._component, FileReadingComponent):
            return FileCheck()
        return self._component.check_files(self._record(**values), thorough=thorough)

    @override
    def output_files(self, values: Mapping[str, Any]) -> tuple[Path, ...]:
        if not issubclass(self._component, FileWritingComponent):
            return ()
        return tuple(self._component.output_files(self._record(**values)))

    @override
    def create(self, name: str, values: Mapping[str, Any]) -> Component:
        build: Any = self._component
        return typing.cast(
            "Component", build() if self._record is None else build(self._record(**values))
        )


__all__ = [
    "DRAWN",
    "REQUIRED",
    "ComponentType",
    "Parameter",
    "ParameterProblem",
    "Parametrised",
    "PythonComponentType",
    "declared",
    "description",
    "parameter",
]
