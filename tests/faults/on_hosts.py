"""What can go wrong between hosts, and the random runs in which it does."""

import random
import signal
from dataclasses import dataclass
from typing import Any, Final

import yaml

from tests.faults.cases import DEADLINE, Fault

HOST: Final = "partner"

_AT: Final = r"component `(far|apart)` at t = [0-9.]+ s: "
_FAR: Final = r"component `far` at t = [0-9.]+ s: "
_SILENT: Final = rf"did not answer within {DEADLINE:g} s"

FAULTS: Final = (
    Fault(kind="none", what="late, irregular, 2 % of pieces end their connection", exit_code=0,
          status="done", deed="none"),
    Fault(kind="raise", what="an exception", exit_code=3, says=_FAR + ".*ValueError", deed="raise"),
    Fault(kind="kill", what="SIGKILL in a step", exit_code=3, says=_FAR + ".*SIGKILL", deed="kill"),
    Fault(kind="kill", what="a crash in native code", exit_code=3, says=_FAR + ".*SIGSEGV",
          deed="crash"),
    Fault(kind="kill", what="SIGKILL of the server", exit_code=3, victim="serve",
          says=_AT + ".*nobody listens there any more", number=signal.SIGKILL),
    Fault(kind="kill", what="SIGKILL of the run", exit_code=3, says="crash in process",
          status="crashed", victim="run", number=signal.SIGKILL),
    Fault(kind="hang", what="a step that never ends", exit_code=3, says=_FAR + ".*" + _SILENT,
          deed="hang"),
    Fault(kind="stop", what="SIGSTOP of the server for ever", exit_code=3, says=_AT + _SILENT,
          victim="serve for ever"),
    Fault(kind="pause", what="the server is stopped for a while", exit_code=0, status="done",
          victim="serve"),
    Fault(kind="pause", what="the run is stopped for a while", exit_code=0, status="done",
          victim="run"),
    Fault(kind="cut", what="all connections are cut, and may come back", exit_code=0, status="done",
          victim="line"),
    Fault(kind="cut", what="all connections are cut for ever", exit_code=3, says=_AT + _SILENT,
          victim="line for ever"),
    Fault(kind="flood", what="10 MB of output", exit_code=0, status="done", deed="flood"),
    Fault(kind="request", what="SIGINT of the run", exit_code=4, says="interrupted",
          status="interrupted", victim="waiting", number=signal.SIGINT),
    Fault(kind="request", what="SIGINT of the server", exit_code=3, victim="serve",
          says=_AT + ".*`nlosim serve` was stopped", number=signal.SIGINT),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class HostCase:
    """One run with two of its three components on a host, and its fault.

    Attributes:
        number: of the case, from 0 on; all else follows from it and the seed.
        scenario: as a scenario file has it, without what the target does.
        at: number of the step of `far` in which it happens.
        pause: how long something is stopped [s].
        delay: of every piece between the hosts, in each direction [s].
        jitter: up to which it is delayed more [s].
        cut: how likely a piece is the last one of its connection.
    """

    number: int
    fault: Fault
    coupling: str
    scenario: dict[str, Any]
    at: int
    pause: float
    delay: float
    jitter: float
    cut: float

    def written(self, deed: str, folder: str = "") -> str:
        """The scenario file.

        Args:
            deed: what `far` does.
            folder: where a gate says that it is reached.
        """
        far = self.scenario["components"]["far"]
        own = {**far["parameters"], "deed": deed, "at": self.at, "folder": folder or "."}
        components = {**self.scenario["components"], "far": {**far, "parameters": own}}
        return yaml.safe_dump({**self.scenario, "components": components}, sort_keys=False)


def drawn_on_hosts(seed: int, number: int) -> HostCase:
    """The case `number` of the campaign `seed`; each fault comes once in as many as there are."""
    chance = random.Random(f"hosts/{seed}/{number}")  # noqa: S311 - cases, not secrets
    fault = FAULTS[number % len(FAULTS)]
    components: dict[str, Any] = {}
    limit = f"{DEADLINE:g} s" if fault.exit_code else "60 s"
    for name in ("here", "far", "apart"):
        components[name] = {
            "type": "fault_parts:Part",
            "step": chance.choice(["10 ms", "20 ms"]),
            "parameters": {
                "busy": round(chance.choice([0.0, 0.001, 0.004]), 3),
                "is_portable": chance.random() < 0.6,
            },
        }
        if name != "here":
            components[name] |= {"host": HOST, "deadline": {"step": limit}}
    names = list(components)
    wires = {b: chance.choice([a for a in names if a != b]) for b in names if chance.random() < 0.8}
    is_rough = fault.deed == "none"
    return HostCase(
        number=number,
        fault=fault,
        coupling=(coupling := chance.choice(["jacobi", "gauss-seidel"])),
        scenario={
            "schema": 1,
            "title": fault.what,
            "time": {"stop": "400 ms"},
            "coupling": {"algorithm": coupling},
            "components": components,
            "connections": [{"from": f"{a}.y", "to": f"{b}.u"} for b, a in wires.items()],
        },
        at=chance.randint(2, 15),
        pause=round(chance.uniform(0.5, 3.0), 1),
        delay=0.02 if is_rough else round(chance.choice([0.0, 0.0, 0.005]), 3),
        jitter=0.01 if is_rough else 0.0,
        cut=0.02 if is_rough else 0.0,
    )
