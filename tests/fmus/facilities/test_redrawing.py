"""What facilities draw anew: times that are still to be drawn, and nothing else."""

import numpy as np

from fmus.facilities import Facilities
from fmus.messages.apm import join
from fmus.messages.records import APM, BSM
from orchestrator.signal import Array
from tests.fmus.facilities.world import SHARER, H, Run, apm_of

SCAN = 10 * H


def sent(redrawn: int | None) -> tuple[Array, Array]:
    """The packets of 0.5 s and of the 0.5 s after, before which draws are renewed, or not."""
    run = Run(Facilities(Facilities.Parameters(processing_time=0.1)))
    found: list[Array] = []
    for k in range(100):
        if k == 50 and redrawn is not None:
            run.component.redraw(np.random.default_rng(redrawn))  # type: ignore[attr-defined]
        scan = k * H // SCAN * SCAN
        found.append(run.step(apms=join([apm_of(SHARER, time=scan)])))
    # what was made by the first half may be ready in the second
    return np.concatenate(found[:50]), np.concatenate(found[60:])


def times(packets: Array, kind: int) -> list[int]:
    """When the packets of a kind are ready [ns]."""
    return [int(t) for t in packets["time"][packets["kind"] == kind]]


def test_processing_times_to_come_are_drawn_anew_and_phases_stay() -> None:
    plain, redrawn, again = sent(None), sent(4), sent(4)
    assert plain[0].tobytes() == redrawn[0].tobytes() == again[0].tobytes()
    assert redrawn[1].tobytes() == again[1].tobytes()
    assert times(plain[1], BSM) == times(redrawn[1], BSM)
    assert len(times(plain[1], APM)) >= 3
    assert not set(times(plain[1], APM)) & set(times(redrawn[1], APM))
