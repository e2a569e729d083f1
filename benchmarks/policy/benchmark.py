"""`nlosim bench policy`."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final, TypeAlias

from typing_extensions import override

from benchmarks.benchmark import Benchmark, Case, Measurement, Row
from benchmarks.policy.loop import RULE_BASED, LoopRun, network_settings
from benchmarks.policy.scans import STARTS, record
from benchmarks.policy.step import StepRun
from benchmarks.policy.transformer import TransformerRun, blocks_for, is_torch_installed
from benchmarks.spread import Spread
from fmus.driving.network.checkpoint import read_network

NETWORK: Final = "network"
"""The setting: which network drives."""

STEP_TARGET: Final = 8.0
"""How long a step of the policy may take [ms]."""

LOOP_TARGET: Final = 5.0
"""Simulated seconds per second."""

PEER: Final = "point transformer"
CARLA: Final = "CARLA + SUMO"
CARLA_SPEED: Final = 0.15
"""3 frames of 0.05 s per second (github.com/carla-simulator/carla/issues/4073)."""

_PARTS: Final = {"": "step_ms", "/sharer": "sharer_ms", "/ego": "ego_ms", "/fusion": "fusion_ms"}
"""Rows of a drive, and the measurement that each shows."""

_Measured: TypeAlias = Mapping[str, Sequence[Measurement]]


class PolicyBenchmark(Benchmark):
    """A step of the network beside the point transformer, and the loop beside the rules."""

    def __init__(self) -> None:
        self._network = "bev-32"

    @property
    @override
    def description(self) -> str:
        return (
            "driving by a network in the red-light scene: CPU milliseconds per step of the policy "
            "with one sharer, and simulated seconds per second of the closed loop"
        )

    @property
    @override
    def peer(self) -> str:
        return (
            "of the steps the encoders alone of a point transformer in COOPERNAUT's published "
            "shape with messages of the same size (PyTorch, float32, one thread, the same scans); "
            "of the loop what a user measured of CARLA with SUMO and one vehicle to be driven, "
            "3 frames of 0.05 s per second, or 30 without the layers of the map "
            "(carla-simulator/carla#4073), no lidar or network included; a user of Bench2Drive, "
            "CARLA with cameras and a network on a GPU, reports about 0.05 "
            "(Thinklab-SJTU/Bench2Drive#40)"
        )

    @property
    @override
    def settings(self) -> Mapping[str, str]:
        return {NETWORK: self._network}

    @override
    def configure(self, settings: Mapping[str, str]) -> None:
        self._network = settings.get(NETWORK, self._network)

    @override
    def require(self) -> None:
        read_network(self._network)

    @override
    def cases(self) -> Mapping[str, Case]:
        checkpoint = read_network(self._network)
        architecture = checkpoint.architecture
        drives = record(STARTS)
        found: dict[str, Case] = {
            f"step/{drive}": StepRun(moments=moments, checkpoint=checkpoint)
            for drive, moments in drives.items()
        }
        if is_torch_installed():
            blocks = blocks_for(architecture.keypoints)
            for drive, moments in drives.items():
                peer = TransformerRun(moments=moments, blocks=blocks)
                found[f"step/{drive}/point-transformer"] = peer
        settings = network_settings(self._network, architecture)
        return {
            **found,
            "loop/network": LoopRun(settings=settings),
            "loop/rule-based": LoopRun(settings=RULE_BASED),
        }

    @override
    def rows(self, measured: _Measured) -> Sequence[Row]:
        steps = [row for drive in STARTS for row in _steps(f"step/{drive}", measured)]
        return [*steps, *_loops(measured)]


def _steps(name: str, measured: _Measured) -> Iterator[Row]:
    """A drive: the whole step, then its parts."""
    if name not in measured:
        return
    peers = measured.get(f"{name}/point-transformer", ())
    for part, key in _PARTS.items():
        spread = Spread.of(run[key] for run in measured[name])
        peer = _median([run[key] for run in peers if key in run])
        yield Row.of(
            name + part,
            spread,
            "ms / step",
            peer=peer,
            peer_name=PEER,
            is_higher_better=False,
            details={} if part else {
                "target_ms": STEP_TARGET,
                "points": Spread.of(run["points"] for run in measured[name]).median,
            },
        )  # fmt: skip


def _loops(measured: _Measured) -> Iterator[Row]:
    for name in ("loop/network", "loop/rule-based"):
        if runs := measured.get(name):
            spread = Spread.of(run["speed"] for run in runs)
            keys = ("simulated_s", "wall_s", "cpu_s", "policy_s", "encoder_s")
            yield Row.of(
                name,
                spread,
                "simulated s / s",
                peer=CARLA_SPEED,
                peer_name=CARLA,
                details={"target": LOOP_TARGET}
                | {key: Spread.of(run[key] for run in runs).median for key in keys},
            )


def _median(numbers: Sequence[float]) -> float | None:
    return Spread.of(numbers).median if numbers else None
