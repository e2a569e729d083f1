"""The recorder: an observer that writes signals to disk while the simulation runs."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from time import monotonic
from typing import Any, Final

import numpy as np
from typing_extensions import override

from orchestrator.errors import SystemStructureError
from orchestrator.observer import Observer, SimulationResult
from orchestrator.patterns import meant
from orchestrator.recording.fingerprint import PartDigest, fingerprint
from orchestrator.recording.layout import (
    INDEX,
    Files,
    RecordingError,
    SignalType,
    rewrite_manifest,
    write_first_manifest,
    write_json,
    write_manifest,
)
from orchestrator.recording.parts import Part, Shared
from orchestrator.recording.reopening import NOTHING, Again
from orchestrator.recording.samples import SampleWriter, sample_writer, times_part
from orchestrator.signal import Causality, Connector, Signals, Variability
from orchestrator.stretch import Samples, Stretch
from orchestrator.suggestion import suggestion
from orchestrator.system import Endpoint, System
from orchestrator.timebase import Time
from orchestrator.wording import Openly, Wording

FLUSH_INTERVAL: Final = 0.5
"""The longest time between two flushes while communication points go by, in wall time [s]."""


def select(system: System, include: Sequence[str], exclude: Sequence[str]) -> tuple[Endpoint, ...]:
    """The outputs of `system` that match a pattern of `include` and none of `exclude`.

    Args:
        system: the system.
        include: patterns of `component.connector` with the wildcards `*`, `?` and `[...]`; the
            name of an output, which may have brackets of its own, means that output.
        exclude: the same.

    Raises:
        SystemStructureError: a pattern of `include` matches no output, or what is selected are
            Python objects.
    """
    outputs = {
        f"{component}.{name}": Endpoint(component, name)
        for component, connectors in system.connectors.items()
        for name, connector in connectors.items()
        if connector.causality is Causality.OUTPUT
    }
    problems = [
        f"cannot record `{pattern}`: no output matches; {suggestion(pattern, outputs)}"
        for pattern in include
        if not meant(pattern, outputs)
    ]
    wanted = {name for pattern in include for name in meant(pattern, outputs)}
    unwanted = {name for pattern in exclude for name in meant(pattern, outputs)}
    selected = {n: end for n, end in outputs.items() if n in wanted and n not in unwanted}
    for name, end in selected.items():
        connector = system.connectors[end.component][end.connector]
        if np.dtype(connector.dtype).hasobject:
            problems.append(f"cannot record `{name}`: {connector.kind()} has no bytes; exclude it")
    if problems:
        raise SystemStructureError(problems)
    return tuple(selected.values())


class Recorder(Observer):
    """Writes the selected outputs, and a manifest that says what was run and how it ended.

    Whatever happens to the process, every file can be read, and what was recorded up to
    `FLUSH_INTERVAL` before is in it. `Recording` reads it.

    Args:
        directory: the run directory; it must not hold a recording yet.
        include: which outputs to record, see `select`.
        exclude: which of them not to.
        manifest: what the caller knows about the run; becomes part of the manifest.
        again: the parts that are there, of a run that is gone on with; `None`: a new one.
        wording: how the manifest says why the run ended; `None`: as it is.
    """

    sees_stretches = True

    def __init__(
        self,
        directory: Path,
        *,
        include: Sequence[str] = ("*",),
        exclude: Sequence[str] = (),
        manifest: Mapping[str, Any] | None = None,
        again: Again | None = None,
        wording: Wording | None = None,
    ) -> None:
        self._is_new = again is None
        self._shared = Shared(again=NOTHING if again is None else again)
        self._wording = wording or Openly()
        self._directory = directory
        self._include = tuple(include)
        self._exclude = tuple(exclude)
        self._manifest = dict(manifest or {})
        self._components: dict[str, _ComponentWriter] = {}
        self._flushed_at: float | None = None  # at first: when there was something to flush
        self._interval: dict[str, Time] = {}
        self._begun = False

    @property
    def fingerprint(self) -> str:
        """SHA-256 over everything written so far; see `orchestrator.recording.fingerprint`."""
        return fingerprint(
            part for component in self._components.values() for part in component.digests()
        )

    @property
    def sizes(self) -> Mapping[str, int]:
        """What each signal `component.connector` takes on disk so far [byte], largest first."""
        sizes = {
            f"{name}.{connector}": size
            for name, component in self._components.items()
            for connector, size in component.sizes().items()
        }
        return dict(sorted(sizes.items(), key=lambda each: (-each[1], each[0])))

    def memory(self) -> dict[str, Any]:
        """What goes on from what is on disk now, as `orchestrator.packing` takes it."""
        self._flush()
        writers = self._components.values()
        return {name: each for writer in writers for name, each in writer.memory()}

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        selected = select(system, self._include, self._exclude)
        if self._is_new and (self._directory / INDEX).exists():
            raise RecordingError(f"`{self._directory}` holds a recording; choose another directory")
        self._begun = True
        types: dict[str, SignalType] = {}
        for end in selected:
            connector = system.connectors[end.component][end.connector]
            types[str(end)] = SignalType.of(connector)
            if end.component not in self._components:
                writer = _ComponentWriter(
                    self._directory, end.component, self._shared, is_new=self._is_new
                )
                self._components[end.component] = writer
            self._components[end.component].add(end.connector, connector)
        self._interval = {"start_ns": start, "stop_ns": stop}
        (self._directory / INDEX).parent.mkdir(parents=True, exist_ok=True)
        write_json(
            self._directory / INDEX, {name: asdict(kind) for name, kind in sorted(types.items())}
        )
        begun = {**self._manifest, **self._interval, "status": "running"}
        write_first_manifest(self._directory, begun)

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        for name in published:
            if name in self._components:
                self._components[name].write(t, values[name])
        self._flush_if_due()

    @override
    def wants(self, system: System) -> Collection[Endpoint]:
        return select(system, self._include, self._exclude)

    @override
    def observe_stretch(self, stretch: Stretch) -> None:
        for name, samples in stretch.samples.items():
            if name in self._components:
                self._components[name].write_stretch(samples, stretch.values[name])
        self._flush_if_due()

    @override
    def end(self, result: SimulationResult) -> None:
        if not self._begun:
            return  # the directory holds somebody else's recording
        problem = self._close()
        error = problem if result.error is None else result.error
        wall_time, end = result.wall_time, result.early_end
        early = None if end is None else {"by": list(end.by), "why": end.text}
        said = {
            **self._manifest,
            **self._interval,
            "status": result.status if result.error is error else "failed",
            "error": None if error is None else self._wording.text(str(error)),
            "reached_ns": result.time,
        }
        ended = {
            **said,
            "ended_early": early,
            "fingerprint": self.fingerprint,
            "recorded_bytes": dict(self.sizes),
            **({"coupling": dict(result.coupling)} if result.coupling else {}),
            "wall_time_s": {
                "total": wall_time.total,
                "orchestrator": wall_time.orchestrator,
                "observers": wall_time.observers,
                "components": dict(wall_time.components),
            },
        }
        try:
            if problem is not None:
                raise problem
            write_manifest(self._directory, ended)
        except OSError as hindrance:
            said |= {
                "status": "failed",
                "error": said["error"] or self._wording.text(str(hindrance)),
            }
            rewrite_manifest(self._directory, said)
            raise

    def _close(self) -> OSError | None:
        """Store everything; what hinders that."""
        problem = None
        for component in self._components.values():
            hindrance = component.close()
            problem = problem or hindrance
        self._shared.release()
        return problem

    def _flush_if_due(self) -> None:
        now = monotonic()
        if self._flushed_at is None:
            self._flushed_at = now
        if now - self._flushed_at > FLUSH_INTERVAL:
            self._flush()

    def _flush(self) -> None:
        for component in self._components.values():
            component.flush()
        self._flushed_at = monotonic()


class _ComponentWriter:
    """Writes the signals of one component and the times at which they were published."""

    def __init__(self, directory: Path, component: str, shared: Shared, *, is_new: bool) -> None:
        self._directory = directory
        self._component = component
        self._shared = shared
        self._is_new = is_new
        files = Files(directory, component, "")
        files.folder.mkdir(parents=True, exist_ok=True)
        self._times = times_part(files, self._shared)
        self._parts: list[Part] = []
        self._writers: dict[str, SampleWriter] = {}
        self._once: list[tuple[str, SampleWriter]] = []
        self._always: list[tuple[str, SampleWriter]] = []

    def add(self, name: str, connector: Connector) -> None:
        """Record `connector`, called `name`, too."""
        files = Files(self._directory, self._component, name)
        writer = sample_writer(files, connector, self._shared)
        self._parts += writer.parts
        self._writers[name] = writer
        fixed = connector.variability is Variability.FIXED
        if not fixed:
            self._always.append((name, writer))
        elif self._is_new:  # else it is there
            self._once.append((name, writer))

    def write(self, t: Time, values: Signals) -> None:
        """Write one sample of every signal."""
        if self._once:
            for name, writer in self._once:
                writer.write(values[name])
            self._once.clear()
        for name, writer in self._always:
            writer.write(values[name])
        self._times.append(t.to_bytes(8, "little", signed=True))

    def write_stretch(self, samples: Samples, values: Signals) -> None:
        """Write the samples of many communication points, the last of which are `values`."""
        for name, writer in self._once:
            writer.write(values[name])
        self._once.clear()
        for name, writer in self._always:
            writer.write_rows(samples.rows[name], len(samples.times), are_kept=samples.are_kept)
        times = samples.times
        self._times.append_rows(times.data.cast("B"), len(times), is_kept=True)

    def flush(self) -> None:
        """Write everything out, times last: they say how many samples there are."""
        for part in (*self._parts, self._times):
            part.flush()

    def close(self) -> OSError | None:
        """Store everything; what hinders that, once all is stored that can be."""
        problem = None
        for part in (*self._parts, self._times):
            try:
                part.close()
            except OSError as error:
                problem = problem or error
        return problem

    def sizes(self) -> Mapping[str, int]:
        """What each signal takes on disk [byte]; their times are nobody's."""
        return {
            name: sum(part.size for part in writer.parts) for name, writer in self._writers.items()
        }

    def memory(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """What goes on from what is on disk once all is flushed, by the name of the part."""
        for part in (*self._parts, self._times):
            yield part.name, part.memory()

    def digests(self) -> Iterator[PartDigest]:
        """The digests of all parts, as far as they were written out."""
        for part in (*self._parts, self._times):
            yield part.digest
