"""Deterministic co-simulation of FMI components: the public names."""

from orchestrator.algorithm.base import CosimulationAlgorithm as CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel as GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi as Jacobi
from orchestrator.component import (
    Component as Component,
    ConcurrentComponent as ConcurrentComponent,
    RestorableComponent as RestorableComponent,
)
from orchestrator.errors import (
    ComponentError as ComponentError,
    ComponentTypeError as ComponentTypeError,
    CosimError as CosimError,
    ScenarioError as ScenarioError,
    SystemStructureError as SystemStructureError,
)
from orchestrator.observer import (
    Observer as Observer,
    SimulationResult as SimulationResult,
)
from orchestrator.parameters import ComponentType as ComponentType, parameter as parameter
from orchestrator.recorder import Recorder as Recorder
from orchestrator.recording import Recording as Recording, Series as Series
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
