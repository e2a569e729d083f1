"""Samples of signals of all kinds."""

from typing import Final

import numpy as np

from orchestrator.signal import Array, Variability
from tests.recordings import output

CARS: Final = {
    "car.id": output("car", dtype=np.int64),
    "car.place": output("car", 2, unit="m"),
    "car.far": output("car", dtype=np.bool_),
    "speed": output(unit="m/s"),
    "gains": output(3, unit="dB"),
    "field": output(5, 4, unit="Pa"),
    "pair": output("car", "radio", unit="dBm", dtype=np.float32),
    "size": output(2, unit="m", variability=Variability.FIXED),
    "word": output(dtype=None, mime_type="text/plain; charset=utf-8"),
    "blob": output(dtype=None),
}


def sample(k: int) -> dict[str, Array | bytes]:
    cars, radios = k % 3, 2
    return {
        "car.id": 10 * np.arange(1, cars + 1, dtype=np.int64) + k,
        "car.place": np.arange(2.0 * cars).reshape(cars, 2) + 100 * k,
        "car.far": np.arange(cars) % 2 == 0,
        "speed": np.array(float(k)),
        "gains": np.array([k, k + 0.25, k + 0.5]),
        "field": np.arange(20.0).reshape(5, 4) + k,
        "pair": np.arange(cars * radios, dtype=np.float32).reshape(cars, radios),
        "size": np.array([4.0, 2.0]),
        "word": f"wörd {k}".encode(),
        "blob": b"\0" * k,
    }


SAMPLES: Final = [sample(k) for k in range(7)]
