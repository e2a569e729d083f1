"""The red-light scene in closed loop, all components in one process."""

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time_ns
from typing import Final

from typing_extensions import override

from benchmarks.benchmark import Case, Measurement
from benchmarks.policy.scans import SCENARIO
from fmus.driving.network.architecture import Architecture
from fmus.facilities.load import FEATURE_SIZES
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from orchestrator.timebase import NANOSECONDS_PER_SECOND


@dataclass(frozen=True, kw_only=True, eq=False)
class LoopRun(Case):
    """One run of the scenario, as `nlosim run` makes it, but for the figure.

    Attributes:
        settings: as `--set` of `nlosim run`.
    """

    settings: Sequence[str]

    @override
    def measure(self) -> Measurement:
        """Run once.

        Returns:
            `speed`: simulated seconds per second of wall time, from the first component's start to
            the end of the recording, as `nlosim run` says it. `simulated_s`, `wall_s` and
            `cpu_s`: with loading the scenario and the metrics. `policy_s`, `encoder_s`: wall time
            in these components.
        """
        wall, cpu = perf_counter(), process_time_ns()
        scenario = load_scenario(SCENARIO, self.settings)
        with tempfile.TemporaryDirectory() as folder:
            outcome = run_scenario(scenario, Path(folder) / "run", figure=False)
        spent = outcome.wall_time.components
        return {
            "speed": outcome.speed,
            "simulated_s": outcome.simulated,
            "wall_s": perf_counter() - wall,
            "cpu_s": (process_time_ns() - cpu) / NANOSECONDS_PER_SECOND,
            "policy_s": spent["policy"],
            "encoder_s": spent["encoder"],
        }


def network_settings(network: str, architecture: Architecture) -> Sequence[str]:
    """What makes the scenario drive by a network.

    Args:
        network: its name, or the path of its checkpoint, from here on.
        architecture: of it.
    """
    size = 4 * architecture.keypoints * (3 + architecture.features)
    sizes = [
        f"components.facilities.parameters.compression={compression}"
        for compression, known in FEATURE_SIZES.items()
        if known == size
    ]
    path = Path(network)
    found = path.absolute() if path.suffix else network
    users = [f"components.{name}.parameters.network={found}" for name in ("policy", "encoder")]
    return [*users, *sizes]


RULE_BASED: Final = (
    "components.policy.type=policy-rule-based",
    "components.encoder.parameters.network=''",
)
"""Settings with which nobody encodes anything, and what is received are objects."""
