"""The parameters of the lidar: those of the lidar FMU, and the device."""

import dataclasses
import importlib.util
import math
from dataclasses import dataclass
from typing import Literal

from orchestrator.errors import ComponentTypeError
from orchestrator.parameters import DRAWN, parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class LidarParameters:
    """Parameters of `lidar-torch`; a test compares all but `device` with the lidar FMU's."""

    channels: int = parameter(
        64,
        minimum=1,
        maximum=512,
        doc="Number of elevations, equally spaced from elevation_top to elevation_bottom",
    )
    elevation_top: float = parameter(
        math.radians(4), unit="rad", minimum=-1.5, maximum=1.5, doc="Elevation of the first channel"
    )
    elevation_bottom: float = parameter(
        math.radians(-20),
        unit="rad",
        minimum=-1.5,
        maximum=1.5,
        doc="Elevation of the last channel",
    )
    azimuths: int = parameter(
        1024,
        minimum=4,
        maximum=8192,
        doc="Number of directions in one turn, the first straight ahead, then counter-clockwise",
    )
    range: float = parameter(
        50.0, unit="m", minimum=0.1, maximum=1000, doc="Largest distance of a hit"
    )
    mount_height: float = parameter(
        0.5,
        unit="m",
        minimum=0,
        maximum=10,
        doc="Height of the sensor over the roof of the vehicle that carries it",
    )
    pitch: float = parameter(
        0.0,
        unit="rad",
        minimum=-math.pi / 2,
        maximum=math.pi / 2,
        doc="Tilt of the mounted sensor, nose down positive",
    )
    roll: float = parameter(
        0.0,
        unit="rad",
        minimum=-math.pi,
        maximum=math.pi,
        doc="Tilt of the mounted sensor, right side down positive",
    )
    range_noise: float = parameter(
        0.02,
        unit="m",
        minimum=0,
        maximum=10,
        doc="Standard deviation of the error along the ray",
    )
    dropout: float = parameter(
        0.02, minimum=0, maximum=1, doc="Probability that a hit is not reported"
    )
    seed: int = parameter(DRAWN, doc="Selects the random numbers of noise and dropout")
    device: Literal["cpu", "cuda"] = parameter(
        "cpu",
        doc="Where to compute: cpu, or cuda for an NVIDIA GPU; never chosen for you, because the "
        "last bits of results differ",
    )


def check_parameters(parameters: LidarParameters) -> None:
    """Refuse parameters that the lidar FMU refuses, and a device that is not there.

    Raises:
        ComponentTypeError: all that is wrong, one sentence each.
    """
    problems = _out_of_bounds(parameters)
    top, bottom = parameters.elevation_top, parameters.elevation_bottom
    if parameters.channels > 1 and not bottom < top:
        problems.append(
            f"`elevation_bottom` is {bottom:g} rad; it must be less than `elevation_top`, "
            f"{top:g} rad"
        )
    seed: object = parameters.seed
    if isinstance(seed, int) and not -(2**63) <= seed < 2**63:
        problems.append(f"`seed` is {seed}; it must be an integer of 64 bits")
    problems += _device_problems(parameters.device)
    if problems:
        raise ComponentTypeError("\n".join(problems))


def _out_of_bounds(parameters: LidarParameters) -> list[str]:
    """Violations of the declared bounds; a scenario is checked before, other callers are not."""
    found = []
    for field in dataclasses.fields(parameters):
        low, high = field.metadata["minimum"], field.metadata["maximum"]
        value = getattr(parameters, field.name)
        if low is not None and not low <= value <= high:  # NaN is refused, too
            found.append(f"`{field.name}` is {value:g}; it must be {low:g} ... {high:g}")
    return found


def _device_problems(device: str) -> list[str]:
    """Why PyTorch cannot compute on `device`; it is imported only to look for a GPU."""
    if importlib.util.find_spec("torch") is None:
        missing = (
            "PyTorch is not installed; run `pip install 'nlosim[torch]'`, or write `type: lidar` "
            "for the same sensor as an FMU"
        )
        return [missing]
    if device == "cpu":
        return []
    if device != "cuda":
        return [f"`device` is {device!r}; it must be cpu or cuda"]
    import torch  # noqa: PLC0415 - takes a second, and is needed for this question only

    if torch.cuda.is_available():
        return []
    reason = (
        f"finds no usable GPU, though it is built for CUDA {torch.version.cuda}"
        if torch.version.cuda
        else "is built without CUDA (see https://pytorch.org/get-started/locally)"
    )
    found = f"the installed PyTorch {torch.__version__} {reason}"
    return [f"`device` is cuda, but {found}; write `device: cpu`"]
