"""What can go wrong, what is to come of it, and the random runs in which it does."""

import random
import signal
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import yaml

DEADLINE: Final = 4.0
"""Of a step of a component that hangs [s]."""

DISK: Final = 12_000
"""The largest file, where the disk is full [byte]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """Something that happens to a run.

    Attributes:
        kind: its row in the table.
        what: is done, in a few words.
        exit_code: the command's; that of `zenoh` may differ.
        says: a pattern that its error message has.
        status: of the manifest, or as a reader sees it.
        deed: of a component, in a step of it.
        victim: of a signal from outside: `host`, `run`, `waiting` or `all`.
        number: of that signal.
        over_zenoh: its exit code over Zenoh, if that is another one.
    """

    kind: str
    what: str
    exit_code: int
    says: str = ""
    status: str = "failed"
    deed: str = "gate"
    victim: str = ""
    number: signal.Signals = signal.SIGSTOP
    over_zenoh: int | None = None


_AT: Final = r"component `{name}` at t = [0-9.]+ s: "
_SILENT: Final = _AT + "did not answer within 4 s"

FAULTS: Final = (
    Fault(kind="none", what="nothing", exit_code=0, status="done", deed="none"),
    Fault(kind="raise", what="an exception", exit_code=3, says=_AT + "ValueError", deed="raise"),
    Fault(kind="kill", what="SIGKILL in a step", exit_code=3, says=_AT + ".*SIGKILL", deed="kill"),
    Fault(kind="kill", what="SIGKILL from outside", exit_code=3, says=_AT + ".*SIGKILL",
          victim="host", number=signal.SIGKILL),
    Fault(kind="kill", what="a crash in native code", exit_code=3, says=_AT + ".*SIGSEGV",
          deed="crash"),
    Fault(kind="kill", what="`os._exit(3)`", exit_code=3, says=_AT + ".*exited with code 3",
          deed="quit"),
    Fault(kind="kill", what="SIGKILL of the run", exit_code=3, says="crash in process",
          status="crashed", victim="run", number=signal.SIGKILL),
    Fault(kind="kill", what="SIGKILL of who waits for the run", exit_code=-9, status="crashed",
          victim="waiting", number=signal.SIGKILL),
    Fault(kind="hang", what="a step that never ends", exit_code=3, says=_SILENT, deed="hang"),
    Fault(kind="hang", what="the interpreter lock is held", exit_code=3, says=_SILENT, deed="hold"),
    Fault(kind="stop", what="SIGSTOP for ever", exit_code=3, says=_SILENT, deed="stop"),
    Fault(kind="pause", what="a component's process is stopped for a while", exit_code=0,
          status="done", victim="host"),
    Fault(kind="pause", what="the run is stopped for a while", exit_code=0, status="done",
          victim="run"),
    Fault(kind="pause", what="everything is stopped for a while", exit_code=0, status="done",
          victim="all"),
    Fault(kind="cut", what="all connections of a component are cut", exit_code=3,
          says=_AT, deed="cut", over_zenoh=0),
    Fault(kind="flood", what="10 MB of output", exit_code=0, status="done", deed="flood"),
    Fault(kind="full disk", what="files cannot grow", exit_code=2, says="File too large",
          deed="none"),
    Fault(kind="request", what="SIGINT", exit_code=4, says="interrupted", status="interrupted",
          victim="waiting", number=signal.SIGINT),
    Fault(kind="request", what="SIGTERM", exit_code=4, says="interrupted", status="interrupted",
          victim="waiting", number=signal.SIGTERM),
    Fault(kind="request", what="SIGHUP", exit_code=4, says="interrupted", status="interrupted",
          victim="waiting", number=signal.SIGHUP),
    Fault(kind="load", what="the run is at nice 19, beside nine busy processes", exit_code=0,
          status="done", deed="none"),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One run and its fault.

    Attributes:
        number: of the case, from 0 on; all else follows from it and the seed.
        scenario: as a scenario file has it.
        target: the component that does something, or whose process gets a signal.
        pause: how long something is stopped [s].
    """

    number: int
    fault: Fault
    transport: str
    coupling: str
    scenario: dict[str, Any]
    target: str
    pause: float

    @property
    def exit_code(self) -> int:
        """The exit code that the run is to have."""
        other = self.fault.over_zenoh
        return self.fault.exit_code if other is None or self.transport != "zenoh" else other

    @property
    def status(self) -> str:
        """The status that its manifest is to have."""
        return "done" if self.exit_code == 0 else self.fault.status

    def written(self) -> str:
        """The scenario file."""
        return yaml.safe_dump(self.scenario, sort_keys=False)


def drawn(seed: int, number: int) -> Case:
    """The case `number` of the campaign `seed`; each fault comes once in as many as there are."""
    chance = random.Random(f"{seed}/{number}")  # noqa: S311 - cases, not secrets
    fault = FAULTS[number % len(FAULTS)]
    names = [f"part{k}" for k in range(chance.randint(2, 4))]
    target = chance.choice(names)
    components: dict[str, Any] = {}
    for name in names:
        apart = True if name == target else chance.choice([True, "on-request", False])
        components[name] = {
            "type": "fault_parts:Part",
            "step": chance.choice(["10 ms", "20 ms"]),
            "process": apart,
            "parameters": {"busy": round(chance.choice([0.0, 0.001, 0.004]), 3)},
        }
    own = components[target]
    own["parameters"] |= {"deed": fault.deed, "at": chance.randint(2, 15)}
    if fault.deed != "none":
        own["parameters"]["has_child"] = chance.random() < 0.5
    if fault.deed in {"hang", "hold", "stop"}:
        own["deadline"] = {"step": f"{DEADLINE:g} s"}
    wires = [(a, b) for a in names for b in names if a != b and chance.random() < 0.5]
    into = {b: a for a, b in wires}
    coupling = chance.choice(["jacobi", "gauss-seidel"])
    transport, pause = chance.choice(["local", "zenoh"]), round(chance.uniform(0.5, 3.0), 1)
    for each in components.values():
        each["parameters"]["is_portable"] = chance.random() < 0.6
    scenario = {
        "schema": 1,
        "title": fault.what,
        "time": {"stop": "400 ms"},
        "coupling": {"algorithm": coupling},
        "components": components,
        "connections": [{"from": f"{a}.y", "to": f"{b}.u"} for b, a in into.items()],
    }
    return Case(
        number=number,
        fault=fault,
        transport=transport,
        coupling=coupling,
        scenario=scenario,
        target=target,
        pause=pause,
    )


def first_of_each_kind(faults: Sequence[Fault] = FAULTS) -> list[int]:
    """The numbers of cases that have one fault of each kind, together."""
    first: dict[str, int] = {}
    for number, fault in enumerate(faults):
        first.setdefault(fault.kind, number)
    return list(first.values())
