"""One scan of every sensor: from the inputs to the `points` signal."""

from typing import Final

import numpy as np
import torch

from fmus.lidar.gpu.check import check_inputs
from fmus.lidar.gpu.cloud import Noise, points, reported
from fmus.lidar.gpu.hits import first_hits
from fmus.lidar.gpu.inputs import Inputs
from fmus.lidar.gpu.noise import scan_key
from fmus.lidar.gpu.parameters import LidarParameters
from fmus.lidar.gpu.pattern import Pattern
from fmus.lidar.gpu.scene import prisms
from fmus.lidar.gpu.view import PrismTensors, Viewpoints, view
from fmus.messages.records import POINT, SENSOR, frame
from orchestrator.signal import Array
from orchestrator.timebase import Time

_BATCH_RAYS: Final = 2**21
"""Sensors are cast together up to so many rays, which bounds the memory."""
_BATCH_PAIRS: Final = 2**22
"""So many pairs of a sensor and a prism at most are cast together, which bounds it too."""
_POINT_LIMIT: Final = 2**32


class Scanner:
    """The sensors of a run: parameters and tables on a device; it has no other state.

    Args:
        parameters: checked; their `seed` is not read.
        seed: of the random numbers, int64.
    """

    def __init__(self, parameters: LidarParameters, seed: int) -> None:
        # more threads gain little on tensors this small, and starve what runs beside
        torch.set_num_threads(1)
        self._parameters = parameters
        self._seed = seed
        self._device = torch.device(parameters.device)
        self._noise = Noise(deviation=parameters.range_noise, dropout=parameters.dropout)
        self._pattern = Pattern.of(parameters, self._device)

    def scan(self, inputs: Inputs, time: Time) -> bytes:
        """A `points` signal (see `fmus.messages.records`).

        Args:
            inputs: everything there is.
            time: of the scan [ns].

        Raises:
            ValueError: the inputs are no scene, or there are too many points for the format.
        """
        check_inputs(inputs)
        carriers = np.flatnonzero(inputs.lidar).astype(np.int64)
        sensors = self._sensors(inputs, carriers, time)
        scene = prisms(inputs)
        there = PrismTensors.of(scene, self._device)
        size = min(_BATCH_RAYS // self._pattern.rays, _BATCH_PAIRS // (len(scene.count) + 1))
        found = []
        for first in range(0, len(carriers), max(size, 1)):
            batch = slice(first, first + max(size, 1))
            cloud, sensors["count"][batch] = self._cast(there, sensors[batch], carriers[batch])
            found.append(cloud)
        total = sensors["count"].sum(dtype=np.int64)
        if total >= _POINT_LIMIT:
            raise ValueError(
                f"the sensors see {total} points, more than {_POINT_LIMIT - 1}; let fewer "
                "vehicles carry one (vehicle.lidar), or lower channels or azimuths"
            )
        sensors["first"] = np.cumsum(sensors["count"]) - sensors["count"]
        return frame("LPTS", sensors, b"".join(found))

    def _sensors(self, inputs: Inputs, carriers: Array, time: Time) -> Array:
        """The records of the sensors, without their points."""
        sensors = np.zeros(len(carriers), SENSOR)
        sensors["vehicle"] = inputs.id[carriers]
        sensors["time"] = time
        sensors["position"] = inputs.position[carriers]
        sensors["position"][:, 2] += inputs.size[carriers, 2]
        sensors["position"][:, 2] += self._parameters.mount_height
        sensors["heading"] = inputs.heading[carriers]
        sensors["pitch"] = self._parameters.pitch
        sensors["roll"] = self._parameters.roll
        return sensors

    def _cast(self, there: PrismTensors, sensors: Array, carriers: Array) -> tuple[bytes, Array]:
        """The points of a batch of sensors, and how many each has."""
        with torch.inference_mode():
            viewpoints = self._viewpoints(sensors, carriers)
            faces = view(there, viewpoints, self._pattern)
            hits = first_hits(faces, viewpoints.position[:, 2], self._pattern)
            found, measured = reported(hits, viewpoints.key, self._noise, self._pattern)
            cloud = points(found, measured, faces, there, self._pattern)
            count = torch.bincount(cloud.sensor, minlength=len(sensors))
            record = cloud.record.cpu().numpy().astype("<i4", copy=False)
            assert record.itemsize * record.shape[1] == POINT.itemsize  # noqa: S101
            return record.tobytes(), count.cpu().numpy()

    def _viewpoints(self, sensors: Array, carriers: Array) -> Viewpoints:
        keys = [scan_key(self._seed, int(s["time"]), int(s["vehicle"])) for s in sensors]
        return Viewpoints(
            position=torch.from_numpy(sensors["position"].copy()).to(self._device),
            cosine=torch.from_numpy(np.cos(sensors["heading"])).to(self._device),
            sine=torch.from_numpy(np.sin(sensors["heading"])).to(self._device),
            vehicle=torch.from_numpy(carriers).to(self._device),
            key=torch.tensor(keys, dtype=torch.int64).to(self._device),
        )
