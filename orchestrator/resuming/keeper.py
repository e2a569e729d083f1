"""Writes the checkpoints of a run, and brings a run back to one."""

import hashlib
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter_ns
from typing import Any, Final

import numpy as np
from typing_extensions import override

from orchestrator.capabilities import CourseFollowing, PortableState
from orchestrator.checkpoints import Checkpoints, Spent, Standing
from orchestrator.component import Component
from orchestrator.errors import ComponentError
from orchestrator.last_call import Call
from orchestrator.packing import PackingError
from orchestrator.recording.recorder import Recorder
from orchestrator.resuming.files import FOLDER, CheckpointError, write_checkpoint
from orchestrator.resuming.manners import Manners, manners_of, meeting
from orchestrator.resuming.steps import StepFile, read_steps
from orchestrator.signal import Signals
from orchestrator.timebase import CommunicationGrid, Duration, Time, format_duration, seconds

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """A checkpoint that a run goes on from.

    Attributes:
        time: its communication point [ns].
        content: what was written.
    """

    time: Time
    content: Mapping[str, Any]


class Keeper(Checkpoints):
    """Writes checkpoints every so often, and begins at one that was found.

    Args:
        directory: of the run, with its folder for checkpoints.
        every: simulated time between two, at least [ns].
        recorder: of the run.
        found: where to begin; `None`: at the start.
    """

    def __init__(
        self, directory: Path, every: Duration, recorder: Recorder, found: Found | None = None
    ) -> None:
        self._directory = directory
        self._every: Final = every
        self._recorder = recorder
        self._found = found
        self._standing: Standing | None = None
        self._manners = Manners(restored=(), replayed=(), obstacle="the run has not begun")
        self._meeting = CommunicationGrid(0, 1, 0)
        self._next: Time | None = None

    @property
    @override
    def spent(self) -> Spent:
        if self._found is None:
            return Spent()
        run_ns, observers_ns = self._found.content["spent"]
        return Spent(run_ns=run_ns, observers_ns=observers_ns)

    @property
    @override
    def are_wanted(self) -> bool:
        return True

    @override
    def begin(self, standing: Standing) -> Time:
        self._standing = standing
        knows_itself = standing.stepping.memory() is not None
        manners = manners_of(standing.system, knows_itself=knows_itself, compiled=standing.compiled)
        sizes = standing.system.step_sizes.values()
        self._manners = manners
        self._meeting = meeting(sizes, standing.start, standing.stop)
        for line in manners.lines():
            _log.log(logging.WARNING if manners.obstacle else logging.INFO, "%s", line)
        if self._found is not None:
            self._check(self._found, manners)
        if manners.obstacle:
            return standing.start
        t = standing.start if self._found is None else self._found.time
        self._next = self._following(t)
        if self._next >= standing.stop and self._found is None:
            times = format_duration(self._every), format_duration(self._meeting.step_size)
            _log.warning("no checkpoint before the end: every %s, where all meet every %s", *times)
        steps = {} if self._found is None else self._found.content["steps"]
        for name in manners.replayed:
            participant = standing.exchange.participants[name]
            path, connectors = self._path(name), standing.system.connectors[name]
            participant.journal = StepFile(path, connectors, steps.get(name))
        if self._found is not None:
            self._return(standing, self._found)
        return t

    def _check(self, found: Found, manners: Manners) -> None:
        """Refuse a checkpoint of components that come back in another way here.

        Raises:
            CheckpointError: there is no way to use it.
        """
        kept = tuple(found.content["states"]), tuple(found.content["steps"])
        if manners.obstacle or kept != (manners.restored, manners.replayed):
            why = manners.obstacle or "other components can save their states"
            raise CheckpointError(
                f"the checkpoint at t = {seconds(found.time):.9g} s cannot be used here: {why}; "
                "`nlosim resume --from-start` makes the run again"
            )

    @override
    def is_due(self, t: Time) -> bool:
        due = self._next
        return due is not None and t >= due and self._meeting.number(t) is not None

    @override
    def limit(self, t: Time, stop: Time) -> Time:
        return stop if self._next is None else min(stop, self._next)

    @override
    def keep(self, t: Time, spent: Spent) -> None:
        standing = self._standing
        assert standing is not None  # noqa: S101 - the run has begun
        before = perf_counter_ns()
        participants = standing.exchange.participants
        states, outputs, steps = {}, {}, {}
        for name in self._manners.restored:
            states[name] = self._dumped(standing, name, t)
            outputs[name] = digest_of(standing.system.components[name].outputs())
        for name in self._manners.replayed:
            outputs[name] = digest_of(standing.system.components[name].outputs())
            journal = participants[name].journal
            assert isinstance(journal, StepFile)  # noqa: S101 - made by `begin`
            steps[name] = journal.memory()
        content = {
            "time": t,
            "spent": [spent.run_ns, spent.observers_ns],
            "recording": self._recorder.memory(),
            "participants": {name: each.memory() for name, each in participants.items()},
            "sources": standing.exchange.sources.memory(),
            "stepping": standing.stepping.memory(),
            "states": states,
            "outputs": outputs,
            "steps": steps,
        }
        try:
            size = write_checkpoint(self._directory, t, content)
        except PackingError as error:
            self._next = None
            _log.warning("no checkpoints: %s; a resumed run steps again from its start", error)
            return
        self._next = self._following(t)
        took = (perf_counter_ns() - before) / 1e9
        _log.info("checkpoint at t = %.9g s: %d bytes, %.3f s", seconds(t), size, took)

    def _following(self, t: Time) -> Time:
        """The first point behind `t` at which a checkpoint can be written and is due."""
        grid, start = self._meeting, self._meeting.start
        due = start + ((t - start) // self._every + 1) * self._every
        at = grid.at(grid.last(due))
        return at if at >= due else grid.after(due)

    def _path(self, name: str) -> Path:
        return self._directory / FOLDER / f"{name}.steps"

    def _dumped(self, standing: Standing, name: str, t: Time) -> bytes:
        participant = standing.exchange.participants[name]
        participant.notes.call(Call.STATE, t)
        try:
            state: object = _portable(standing.system.components[name]).dump()
        except Exception as error:
            raise participant.failure(t, error, "while saving its state: ") from error
        if not isinstance(state, bytes):
            what = f"while saving its state: `dump` gave `{type(state).__name__}`, not bytes"
            raise ComponentError(name, t, what)
        return state

    def _return(self, standing: Standing, found: Found) -> None:
        """Bring all that there is to where it was at a checkpoint."""
        content, exchange = found.content, standing.exchange
        for name in self._manners.replayed:
            self._step_again(standing, found, name)
        for name, state in content["states"].items():
            participant = exchange.participants[name]
            participant.notes.call(Call.STATE, found.time)
            try:
                _portable(standing.system.components[name]).load(state)
            except Exception as error:
                raise participant.failure(
                    found.time, error, "while restoring its state: "
                ) from error
            _log.info("restored `%s` from %d bytes", name, len(state))
            if digest_of(standing.system.components[name].outputs()) != content["outputs"][name]:
                what = (
                    "component `%s` came to other outputs than before: `load` does not take up all "
                    "of `dump`, or they depend on more; what follows is not what it would have been"
                )
                _log.warning(what, name)
        exchange.sources.recall(content["sources"])
        for name, memory in content["participants"].items():
            exchange.participants[name].recall(memory)
        standing.stepping.recall(content["stepping"])

    def _step_again(self, standing: Standing, found: Found, name: str) -> None:
        """Let one component make all its steps until a checkpoint.

        Raises:
            ComponentError: it fails, or does not come to where it was.
        """
        component, participant = (
            standing.system.components[name],
            standing.exchange.participants[name],
        )
        follower = component.capability(CourseFollowing)  # type: ignore[type-abstract]
        memory, connectors = found.content["steps"][name], standing.system.connectors[name]
        before = perf_counter_ns()
        for piece in read_steps(self._path(name), connectors, memory):
            standing.look_up()
            participant.notes.step(piece.t)
            try:
                if follower is not None and piece.courses:
                    follower.follow(piece.courses)
                component.step(piece.inputs, piece.t, piece.h)
            except Exception as error:
                raise participant.failure(piece.t, error, "while stepping again: ") from error
        took = (perf_counter_ns() - before) / 1e9
        _log.info("`%s` made %d steps again in %.2f s", name, memory["count"], took)
        if digest_of(component.outputs()) != found.content["outputs"][name]:
            what = "stepped again to another state than before: it depends on more than its inputs"
            raise ComponentError(name, found.time, what)


def _portable(component: Component) -> PortableState:
    found = component.capability(PortableState)  # type: ignore[type-abstract]
    assert found is not None  # noqa: S101 - asked before
    return found


def digest_of(signals: Signals) -> str:
    """SHA-256 of the names, types, shapes and bytes of `signals`."""
    total = hashlib.sha256()
    for name in sorted(signals):
        value = signals[name]
        if isinstance(value, bytes):
            total.update(f"{name} {len(value)}\n".encode() + value)
        else:
            array = np.asarray(value)
            total.update(f"{name} {array.dtype.str} {array.shape}\n".encode() + array.tobytes())
    return total.hexdigest()
