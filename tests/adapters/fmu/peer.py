"""The same FMU driven by FMPy, function by function; nothing here is ours."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import fmpy
import fmpy.fmi2
import fmpy.fmi3
import numpy as np

from orchestrator.signal import Signal, Signals

_DTYPES: Final = {
    **{name: np.dtype(name.lower()) for name in ("Float32", "Float64")},
    **{f"{sign}Int{n}": np.dtype(f"{sign}int{n}".lower()) for sign in ("", "U") for n in (8, 16)},
    **{f"{sign}Int{n}": np.dtype(f"{sign}int{n}".lower()) for sign in ("", "U") for n in (32, 64)},
    "Boolean": np.dtype(bool),
    "Real": np.dtype(np.float64),
    "Integer": np.dtype(np.int32),
}


class Peer:
    """One instance, called through FMPy.

    Args:
        path: of the FMU.
        folder: where it is unpacked.
    """

    def __init__(self, path: Path, folder: Path) -> None:
        self.model = fmpy.read_model_description(str(path), validate=False)
        self.is_fmi2 = self.model.fmiVersion.startswith("2")
        self.variables = {v.name: v for v in self.model.modelVariables}
        fmpy.extract(str(path), str(folder))
        module = fmpy.fmi2.FMU2Slave if self.is_fmi2 else fmpy.fmi3.FMU3Slave
        self.fmu: Any = module(
            guid=self.model.guid,
            modelIdentifier=self.model.coSimulation.modelIdentifier,
            unzipDirectory=str(folder),
            instanceName="peer",
        )
        self.fmu.instantiate()
        self.is_initialised = False
        self.lengths = {
            v.name: int(v.start)
            for v in self.model.modelVariables
            if v.causality == "structuralParameter"
        }

    def named(self, causality: str) -> list[str]:
        """The variables of that causality."""
        return [v.name for v in self.model.modelVariables if v.causality == causality]

    def configure(self, lengths: Mapping[str, int]) -> None:
        """Give structural parameters new values."""
        changed = {name: n for name, n in lengths.items() if n != self.lengths[name]}
        if not changed:
            return
        self.fmu.enterConfigurationMode()
        for name, length in changed.items():
            getattr(self.fmu, f"set{self._kind(name)}")([self._reference(name)], [length])
        self.fmu.exitConfigurationMode()
        self.lengths.update(changed)

    def begin(self, start: float, stop: float | None) -> None:
        """Enter initialisation mode."""
        if self.is_fmi2:
            self.fmu.setupExperiment(startTime=start, stopTime=stop)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=start, stopTime=stop)

    def finish_beginning(self) -> None:
        """Leave initialisation mode."""
        self.fmu.exitInitializationMode()
        self.is_initialised = True

    def set(self, values: Mapping[str, Signal]) -> None:
        """Set variables, each by a call of its own."""
        for name, value in values.items():
            function = getattr(self.fmu, f"set{self._kind(name)}")
            function([self._reference(name)], self._elements(name, value))

    def get(self, names: Sequence[str]) -> Signals:
        """Variables by name, each by a call of its own."""
        return {name: self._value(name) for name in names}

    def step(self, t: float, h: float) -> None:
        """Make one step that may be taken back."""
        self.fmu.doStep(t, h, False)

    def close(self) -> None:
        """Terminate and free it."""
        if self.is_initialised:
            self.fmu.terminate()
        self.fmu.freeInstance()

    def _reference(self, name: str) -> int:
        return int(self.variables[name].valueReference)

    def _kind(self, name: str) -> str:
        kind = str(self.variables[name].type)
        return {"Enumeration": "Integer" if self.is_fmi2 else "Int64"}.get(kind, kind)

    def _shape(self, name: str) -> tuple[int, ...]:
        axes = self.variables[name].dimensions or ()
        return tuple(
            int(axis.start) if axis.variable is None else self.lengths[axis.variable.name]
            for axis in axes
        )

    def _elements(self, name: str, value: Signal) -> list[Any]:
        if isinstance(value, bytes):
            return [value.decode() if self._kind(name) == "String" else value]
        found: list[Any] = np.asarray(value, _DTYPES[self._kind(name)]).ravel().tolist()
        return found

    def _value(self, name: str) -> Signal:
        kind, shape = self._kind(name), self._shape(name)
        function = getattr(self.fmu, f"get{kind}")
        if kind == "Binary":
            return bytes(function([self._reference(name)])[0] or b"")
        if kind == "String":
            text = function([self._reference(name)])[0]
            return text if isinstance(text, bytes) else str(text).encode()
        count = () if self.is_fmi2 else (int(np.prod(shape, dtype=int)),)
        found = function([self._reference(name)], *count)
        return np.array(found, _DTYPES[kind]).reshape(shape)
