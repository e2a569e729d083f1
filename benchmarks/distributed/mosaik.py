"""The peer mosaik: a simulator in each process, JSON over TCP between them and mosaik.

`python -m benchmarks.distributed.mosaik world RING STEPS` runs the simulation and says what came
of it; `... simulator ADDRESS` is a member, which mosaik starts.
"""

import base64
import importlib
import json
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from time import perf_counter_ns
from typing import Any, Final

import numpy as np
from typing_extensions import override

from benchmarks.distributed.children import ended, hear, spawn
from benchmarks.distributed.participant import Participant, missing
from benchmarks.distributed.ring import PARALLEL, Ring
from orchestrator.signal import Array

_META: Final = {
    "api_version": "3.0",
    "type": "time-based",
    "models": {"Member": {"public": True, "params": [], "attrs": ["u", "y"]}},
}


class Mosaik(Participant):
    """Time-based simulators; arrays are Base64 in JSON, which is shorter than lists of numbers."""

    label = "mosaik"
    share = 0.1
    most = 5

    @property
    @override
    def why_not(self) -> str:
        return missing("mosaik", "mosaik")

    @override
    def stamps(self, ring: Ring, steps: int) -> Sequence[int]:
        world = spawn(__name__, ["world", ring.to_text(), steps])
        with ended([world]):
            said = hear(world)
        ring.check(self.label, said["right"], steps)
        found: Sequence[int] = said["stamps"]
        return found


def world(ring: Ring, steps: int) -> None:
    """Run the simulation."""
    mosaik: Any = importlib.import_module("mosaik")
    command = f"{sys.executable} -P -m {__spec__.name} simulator %(addr)s"
    made = mosaik.World({"Member": {"cmd": command}}, skip_greetings=True, configure_logging=False)
    with tempfile.TemporaryDirectory() as folder:
        members = [
            made.start("Member", ring=ring.to_text(), number=number, folder=folder).Member()
            for number in range(ring.members)
        ]
        for number, member in enumerate(members):
            if ring.algorithm == PARALLEL or number == 0:
                before = (number - 1) % ring.members
                start = {"y": _text(ring.start(before))}
                made.connect(
                    members[before], member, ("y", "u"), time_shifted=True, initial_data=start
                )
            else:
                made.connect(members[number - 1], member, ("y", "u"))
        made.run(until=steps, print_progress=False)
        said = [json.loads(each.read_text()) for each in sorted(Path(folder).iterdir())]
    result = {"right": [each["right"] for each in said], "stamps": said[0]["stamps"]}
    print(json.dumps(result), flush=True)  # noqa: T201


def simulator() -> None:
    """Be one member."""
    api: Any = importlib.import_module("mosaik_api_v3")

    class Simulator(api.Simulator):  # type: ignore[misc]  # of a package that may be missing
        """Adds 1 to every element."""

        def __init__(self) -> None:
            super().__init__(_META)
            self._stamps: list[int] = []

        def init(
            self, sid: str, time_resolution: float = 1.0, *, ring: str, number: int, folder: str
        ) -> Any:
            del sid, time_resolution
            self._ring, self._number, self._folder = Ring.from_text(ring), number, Path(folder)
            return self.meta

        def create(self, num: int, model: str) -> list[dict[str, Any]]:
            return [{"eid": f"it-{each}", "type": model} for each in range(num)]

        def step(self, time: int, inputs: Mapping[str, Any], max_advance: int) -> int:
            del max_advance
            self._stamps.append(perf_counter_ns())
            (text,) = inputs["it-0"]["u"].values()
            self._value = np.frombuffer(base64.b64decode(text), np.float64) + 1.0
            return time + 1

        def get_data(self, outputs: Mapping[str, Any]) -> dict[str, dict[str, str]]:
            return {eid: {"y": _text(self._value)} for eid in outputs}

        def finalize(self) -> None:
            right = self._ring.is_last(self._number, self._value, len(self._stamps))
            stamps = [] if self._number else [*self._stamps, perf_counter_ns()]
            said = json.dumps({"right": right, "stamps": stamps})
            (self._folder / f"{self._number:02}").write_text(said)

    api.start_simulation(Simulator())


def _text(value: Array) -> str:
    return base64.b64encode(value.data).decode()


if __name__ == "__main__":
    if sys.argv[1] == "world":
        world(Ring.from_text(sys.argv[2]), int(sys.argv[3]))
    else:
        sys.argv[1:] = sys.argv[2:]
        simulator()
