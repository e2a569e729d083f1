"""Deterministic co-simulation of FMI components: the public names.

Nothing is imported before it is used, so that the command line starts quickly and can choose the
number of threads before NumPy is loaded.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from orchestrator.algorithm.base import CosimulationAlgorithm as CosimulationAlgorithm
    from orchestrator.algorithm.fixed_point import FixedPoint as FixedPoint
    from orchestrator.algorithm.gauss_seidel import GaussSeidel as GaussSeidel
    from orchestrator.algorithm.jacobi import Jacobi as Jacobi
    from orchestrator.algorithm.quasi_newton import InterfaceQuasiNewton as InterfaceQuasiNewton
    from orchestrator.component import (
        Component as Component,
        ConcurrentComponent as ConcurrentComponent,
        DecidingComponent as DecidingComponent,
        Decision as Decision,
        RestorableComponent as RestorableComponent,
    )
    from orchestrator.errors import (
        ComponentError as ComponentError,
        ComponentTypeError as ComponentTypeError,
        CosimError as CosimError,
        ScenarioError as ScenarioError,
        SystemStructureError as SystemStructureError,
    )
    from orchestrator.input_files import (
        FileCheck as FileCheck,
        FileReadingComponent as FileReadingComponent,
    )
    from orchestrator.measure import Measure as Measure
    from orchestrator.observer import (
        Observer as Observer,
        SimulationResult as SimulationResult,
    )
    from orchestrator.parameters import ComponentType as ComponentType, parameter as parameter
    from orchestrator.recording.reader import Recording as Recording, Series as Series
    from orchestrator.recording.recorder import Recorder as Recorder
    from orchestrator.results import (
        frame as frame,
        frames as frames,
        metrics as metrics,
        tables_of as tables_of,
    )
    from orchestrator.signal import (
        Causality as Causality,
        Connector as Connector,
        Signal as Signal,
        Signals as Signals,
        Variability as Variability,
    )
    from orchestrator.simulation import simulate as simulate
    from orchestrator.system import (
        Connection as Connection,
        Endpoint as Endpoint,
        System as System,
        expand as expand,
    )
    from orchestrator.timebase import Duration as Duration, Time as Time, nanoseconds as nanoseconds

_HOMES: Final = {
    "orchestrator.algorithm.base": ("CosimulationAlgorithm",),
    "orchestrator.algorithm.fixed_point": ("FixedPoint",),
    "orchestrator.algorithm.gauss_seidel": ("GaussSeidel",),
    "orchestrator.algorithm.jacobi": ("Jacobi",),
    "orchestrator.algorithm.quasi_newton": ("InterfaceQuasiNewton",),
    "orchestrator.component": (
        "Component",
        "ConcurrentComponent",
        "DecidingComponent",
        "Decision",
        "RestorableComponent",
    ),
    "orchestrator.errors": (
        "ComponentError",
        "ComponentTypeError",
        "CosimError",
        "ScenarioError",
        "SystemStructureError",
    ),
    "orchestrator.input_files": ("FileCheck", "FileReadingComponent"),
    "orchestrator.measure": ("Measure",),
    "orchestrator.observer": ("Observer", "SimulationResult"),
    "orchestrator.parameters": ("ComponentType", "parameter"),
    "orchestrator.recording.reader": ("Recording", "Series"),
    "orchestrator.recording.recorder": ("Recorder",),
    "orchestrator.results": ("frame", "frames", "metrics", "tables_of"),
    "orchestrator.signal": ("Causality", "Connector", "Signal", "Signals", "Variability"),
    "orchestrator.simulation": ("simulate",),
    "orchestrator.system": ("Connection", "Endpoint", "System", "expand"),
    "orchestrator.timebase": ("Duration", "Time", "nanoseconds"),
}
_HOME_OF: Final = {name: module for module, names in _HOMES.items() for name in names}
__all__ = sorted(_HOME_OF)  # noqa: PLE0605 - the names are those of the table above


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module `orchestrator` has no attribute `{name}`")
    return getattr(import_module(_HOME_OF[name]), name)
