"""Recordings of numbers that are known at every time."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Causality, Connector, Signals, Variability
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.testing import FunctionComponent

MS = 1_000_000


def output(
    unit: str = "1", dtype: type = np.float64, shape: tuple[int | str, ...] = ()
) -> Connector:
    return Connector(causality=Causality.OUTPUT, unit=unit, dtype=dtype, shape=shape)


FIXED = Connector(causality=Causality.OUTPUT, unit="kg", variability=Variability.FIXED)

PLANT: Mapping[str, Connector] = {
    "ramp": output("m"),
    "is_late": output(dtype=np.bool_),
    "count": output(dtype=np.int32),
    "force": output("N", shape=(3,)),
    "many": output(shape=(10,)),
    "list": output(shape=("item",)),
    "mass": FIXED,
}


def plant(t: int) -> Signals:
    """`ramp` is the time in metres, `count` that in tenths of a second."""
    return {
        "ramp": np.array(t / 1e9),
        "is_late": np.array(t > 600 * MS),
        "count": np.array(t // (100 * MS), np.int32),
        "force": np.array([1.0, 2.0, -3.0]) * (t / 1e9),
        "many": np.zeros(10),
        "list": np.zeros(t // (500 * MS)),
        "mass": np.array(2.0),
    }


def recorded(folder: Path, *, step: int = 100 * MS, stop: int = 1000 * MS) -> Recording:
    """A plant, and a sensor that tells `-ramp` every 250 ms."""
    sensor = {"value": output("m")}
    components = {
        "plant": FunctionComponent(PLANT, lambda state, inputs, t: (None, plant(t))),
        "sensor": FunctionComponent(
            sensor, lambda state, inputs, t: (None, {"value": np.array(-t / 1e9)})
        ),
    }
    system = System(components, {"plant": step, "sensor": 250 * MS}, [])
    simulate(system, Jacobi(), start=0, stop=stop, seed=0, observers=[Recorder(folder)])
    return Recording(folder)
