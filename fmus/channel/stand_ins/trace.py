"""A channel that replays recorded links."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from typing_extensions import override

from fmus.channel.stand_ins.component import LinkModelComponent
from fmus.channel.stand_ins.delivery import (
    NOISE_LOSS,
    RECEIVED,
    UNNOTICED,
    Codes,
    Int,
    LinkModel,
    Receivers,
    Verdicts,
)
from fmus.channel.stand_ins.packets import Frame
from fmus.channel.stand_ins.parameters import RadioParameters
from fmus.channel.stand_ins.philox import reception_draws
from fmus.channel.stand_ins.rows import NO_ROW
from fmus.channel.stand_ins.trace_file import (
    UNKNOWN_DELAY,
    OutcomeTrace,
    PerTrace,
    Samples,
    read_names,
    read_trace,
)
from fmus.messages.records import LINKS
from orchestrator.errors import ComponentTypeError
from orchestrator.parameters import parameter
from orchestrator.timebase import Duration, nanoseconds

Missing: TypeAlias = Literal["lost", "received", "error"]


@dataclass(frozen=True, slots=True, kw_only=True)
class TraceParameters(RadioParameters):
    """The recording, and how it is applied to packets that it does not know."""

    file: Path = parameter(doc="recorded links, CSV or Parquet; see docs/formats.md")
    vehicles: Path | None = parameter(
        None, doc="CSV file `name,id` with the numbers of vehicles that the recording names by text"
    )
    time_offset: float = parameter(
        0.0, unit="s", minimum=-4e9, maximum=4e9, doc="added to the times of the recording"
    )
    tolerance: float = parameter(
        0.1,
        unit="s",
        minimum=0.0,
        maximum=10.0,
        doc="how far in time a recorded outcome may lie from the frame that it is applied to",
    )
    missing: Missing = parameter(
        "lost", doc="where the recording says nothing: lost (outcome U), received, or error"
    )


class Trace(LinkModelComponent):
    """A channel that replays recorded links: packet error rates over time, or single outcomes.

    An error rate holds from its time until the link's next. An outcome is applied to the frame
    of its link that is nearest in time, within `tolerance`, and used once, so that as many
    frames are lost, in the same bursts, as in the recording.
    """

    Parameters: TypeAlias = TraceParameters

    def __init__(self, parameters: TraceParameters) -> None:
        super().__init__(parameters)
        self._parameters = parameters
        try:
            offset = nanoseconds(parameters.time_offset)
            self._tolerance = nanoseconds(parameters.tolerance)
        except ValueError as error:
            raise ComponentTypeError(f"`time_offset` or `tolerance`: {error}") from None
        names = {} if parameters.vehicles is None else read_names(parameters.vehicles)
        self._trace = read_trace(parameters.file, names, offset)

    @override
    def link_model(self, seed: int) -> LinkModel:
        missing = self._parameters.missing
        match self._trace:
            case PerTrace() as trace:
                return _ReplayedRates(trace, missing, seed)
            case OutcomeTrace() as trace:
                return _ReplayedOutcomes(trace, missing, self._tolerance)


class _ReplayedRates(LinkModel):
    """Draws from the error rates of a recording."""

    def __init__(self, trace: PerTrace, missing: Missing, seed: int) -> None:
        self._trace = trace
        self._missing: Missing = missing
        self._seed = seed

    @override
    def judge(self, frame: Frame, receivers: Receivers, usual_delay: Int) -> Verdicts:
        samples = self._trace.samples
        rows = samples.rows.at(frame.time, frame.transmitter, receivers.id)
        outcome = _without_recording(rows, self._missing, frame, receivers)
        known = rows != NO_ROW
        draws = reception_draws(self._seed, frame.packet, frame.hop, receivers.id[known])
        is_received = draws < 1.0 - self._trace.per[rows[known]]
        outcome[known] = np.where(is_received, RECEIVED, NOISE_LOSS)
        return _verdicts(samples, rows, outcome, usual_delay)


class _ReplayedOutcomes(LinkModel):
    """Applies each outcome of a recording to one frame."""

    def __init__(self, trace: OutcomeTrace, missing: Missing, tolerance: Duration) -> None:
        self._trace = trace
        self._missing: Missing = missing
        self._tolerance = tolerance
        self._used = bytearray(len(trace.samples.rows))

    @override
    def judge(self, frame: Frame, receivers: Receivers, usual_delay: Int) -> Verdicts:
        samples = self._trace.samples
        rows = samples.rows.nearest(
            frame.time, frame.transmitter, receivers.id, self._tolerance, self._used
        )
        outcome = _without_recording(rows, self._missing, frame, receivers)
        known = rows != NO_ROW
        for row in rows[known].tolist():
            self._used[row] = True
        outcome[known] = self._trace.outcome[rows[known]]
        delay, recorded = usual_delay.copy(), self._trace.delay[rows[known]]
        delay[known] = np.where(recorded == UNKNOWN_DELAY, delay[known], recorded)
        return _verdicts(samples, rows, outcome, delay)

    @override
    def save(self) -> bytes:
        return bytes(self._used)

    @override
    def restore(self, state: bytes) -> None:
        self._used = bytearray(state)


def _without_recording(rows: Int, missing: Missing, frame: Frame, receivers: Receivers) -> Codes:
    """The outcomes at receivers of which the recording says nothing, shape (receiver,).

    Raises:
        ValueError: there are such receivers, and that is an error.
    """
    if missing == "error" and (rows == NO_ROW).any():
        receiver = receivers.id[rows == NO_ROW][0]
        raise ValueError(
            f"the recording says nothing about the link {frame.transmitter} -> {receiver} at "
            f"{frame.time / 1e9:.9g} s (packet {frame.packet}, hop {frame.hop}); `missing: lost` "
            "or `missing: received` would go on"
        )
    return np.full(len(rows), RECEIVED if missing == "received" else UNNOTICED, np.uint8)


def _verdicts(samples: Samples, rows: Int, outcome: Codes, delay: Int) -> Verdicts:
    """The verdicts with what the recording says beside the outcome; NaN and LOS without a row."""
    known = rows != NO_ROW
    power, snir = np.full(len(rows), np.nan), np.full(len(rows), np.nan)
    link = np.full(len(rows), LINKS.index("LOS"), np.uint8)
    power[known], snir[known] = samples.power_dbm[rows[known]], samples.snir_db[rows[known]]
    link[known] = samples.link[rows[known]]
    return Verdicts(outcome=outcome, delay=delay, power_dbm=power, snir_db=snir, link=link)
