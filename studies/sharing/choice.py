"""How often the match chose the best sharer, and what it lost where it did not."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from typing_extensions import override

from fmus.messages.apm import read_header, split
from fmus.messages.records import NO_VEHICLE
from orchestrator import Measure
from orchestrator.measure import Answer
from orchestrator.palette import COLOURS
from orchestrator.parameters import parameter
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from orchestrator.timebase import Time, nanoseconds
from studies.sharing.coverage import Source, Surroundings, nearest_of, truth_at
from studies.verification.perception.truth import Interest, Truth

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RIGHT: Final = 0.95
"""Who reveals this share of what the best candidate does is as right as it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """One look at the match, beside what is so.

    Attributes:
        time: [s].
        candidates: vehicles with lidar and radio that could see some of the area of interest.
        heard: those of them whose matrix the requester had.
        hidden: road of interest that the requester does not know [m^2].
        chosen: the first of the match; `NO_VEHICLE` without one.
        best: the candidate that reveals most; `NO_VEHICLE` without candidates.
        revealed: what the chosen one reveals of the hidden road [m^2].
        most: what the best one does.
        most_heard: what the best of those heard does.
        all: what all candidates together do.
        nearest: what the nearest one does.
        mean: the mean of all, what a random one does.
        hidden_vehicles: those in the area of interest that the requester does not see.
        told: those of them that the chosen one sees, or is.
        told_all: those that any candidate does.
    """

    time: float
    candidates: int
    heard: int
    hidden: float
    chosen: int
    best: int
    revealed: float
    most: float
    most_heard: float
    all: float
    nearest: float
    mean: float
    hidden_vehicles: int
    told: int
    told_all: int


def compare(
    time: Time, truth: Truth, *, chosen: int, heard: Sequence[int], nearest: int | None
) -> Moment:
    """Compare a choice with the truth.

    Args:
        time: [ns].
        truth: what is hidden, and who reveals it.
        chosen: whom the match puts first; `NO_VEHICLE` without one.
        heard: whose matrices the requester has.
        nearest: the nearest candidate; `None` without any.
    """
    areas = truth.areas
    best = max(areas, key=lambda one: areas[one], default=NO_VEHICLE)
    told_all: set[int] = set().union(*(truth.found_by(one) for one in areas))
    return Moment(
        time=time / 1e9,
        candidates=len(areas),
        heard=sum(one in areas for one in set(heard)),
        hidden=float(truth.hidden.area),
        chosen=chosen,
        best=best,
        revealed=areas.get(chosen, 0.0),
        most=truth.best,
        most_heard=max((areas[one] for one in heard if one in areas), default=0.0),
        all=float(shapely.union_all(list(truth.revealed.values())).area) if areas else 0.0,
        nearest=0.0 if nearest is None else areas[nearest],
        mean=sum(areas.values()) / len(areas) if areas else 0.0,
        hidden_vehicles=len(truth.hidden_vehicles),
        told=len(truth.found_by(chosen)) if chosen in areas else 0,
        told_all=len(told_all),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SharerChoice(Measure):
    """Whether the match puts the best sharer first.

    At each look, the requester's area of interest is the road within `corridor` of its route, not
    nearer than its lowest beam meets the ground and not farther than `horizon`. Hidden is what it
    does not know of it by exact geometry; a candidate, any vehicle with lidar and radio within
    `horizon` and 50 m, reveals what it knows of that. Best is who reveals most, right who reveals
    95 % of that. The regret is the share of the best candidate's area that the chosen one does not
    reveal: 0 for the best, 1 where nobody was chosen. Looks at which nobody reveals `demand` do not
    count. Numbers about the choice are `null` where no matrix ever reached the requester, as in
    ways of sharing that have none.
    """

    ego: str = parameter("traffic.ego", doc="the requester, beneath which `id` and `route` are")
    match: str = parameter("perception.match", doc="beneath which `sharer` is")
    received: str = parameter("facilities.received.apms", doc="the matrices that reached it")
    vehicle: str = parameter("traffic.vehicle", doc="what the signals of vehicles begin with")
    building: str = parameter("traffic.building", doc="what the signals of buildings begin with")
    road: str = parameter("traffic.road", doc="what the signals of the road begin with")
    corridor: float = parameter(25.0, unit="m", minimum=0.0, doc="reach beside the route")
    horizon: float = parameter(35.0, unit="m", minimum=0.0, doc="how far it looks")
    demand: float = parameter(25.0, unit="m^2", minimum=0.0, doc="least area that is worth asking")
    interval: float = parameter(0.5, unit="s", minimum=0.001, doc="in which is looked once")

    @override
    def signals(self) -> Sequence[str]:
        return (
            *self._source.signals(),
            f"{self.match}.sharer",
            self.received,
            *(f"{self.building}.{name}" for name in ("vertex", "index", "height")),
            *(f"{self.road}.{name}" for name in ("vertex", "index")),
        )

    @property
    def _source(self) -> Source:
        interest = Interest(corridor=self.corridor, horizon=self.horizon)
        return Source(vehicle=self.vehicle, ego=self.ego, interest=interest)

    @override
    def compute(self, recording: Recording) -> Answer:
        for name in self.signals():
            recording[name]  # says which one is missing, before the work begins
        looks = [look for look in self._looks(recording) if look.candidates]
        wanted = [look for look in looks if look.most >= max(self.demand, 1e-9)]
        has_matrices = any(look.heard for look in looks)
        table = {
            field.name: np.array([getattr(look, field.name) for look in looks])
            for field in fields(Moment)
        }
        return Answer(
            numbers={
                "looks": len(looks),
                "wanted": len(wanted),
                **_situation(wanted),
                **(_choice(wanted) if has_matrices else dict.fromkeys(_choice([]))),
            },
            tables={"looks": table},
            panel=lambda axes: _draw(axes, table),
        )

    def _looks(self, recording: Recording) -> list[Moment]:
        surroundings = Surroundings.of(recording, self.road, self.building)
        times = recording[f"{self.match}.sharer"].times
        if len(times) == 0:
            return []
        step = nanoseconds(self.interval)
        found = []
        for time in range(int(times[0]) + step, int(times[-1]) + 1, step):
            truth = truth_at(recording, self._source, surroundings, time)
            if truth is not None:
                found.append(self._look(recording, truth, time))
        return found

    def _look(self, recording: Recording, truth: Truth, time: Time) -> Moment:
        sharers = np.asarray(recording[f"{self.match}.sharer"].at(time)).ravel()
        messages = split(bytes(recording[self.received].at(time)))
        candidates = list(truth.revealed)
        return compare(
            time,
            truth,
            chosen=int(sharers[0]) if len(sharers) else NO_VEHICLE,
            heard=[int(read_header(message)["vehicle"]) for message in messages],
            nearest=nearest_of(recording, self._source, time, candidates) if candidates else None,
        )


def _situation(wanted: Sequence[Moment]) -> dict[str, float | int | bool | str | None]:
    """What there was to choose from."""
    return {
        "candidates": _mean([look.candidates for look in wanted]),
        "hidden_m2": _mean([look.hidden for look in wanted]),
        "most_m2": _mean([look.most for look in wanted]),
        "all_m2": _mean([look.all for look in wanted]),
        "hidden_vehicles": _mean([look.hidden_vehicles for look in wanted]),
        "told_all": _ratio(
            sum(look.told_all for look in wanted), sum(look.hidden_vehicles for look in wanted)
        ),
        "regret_random": _mean([1 - look.mean / look.most for look in wanted]),
        "regret_nearest": _mean([1 - look.nearest / look.most for look in wanted]),
    }


def _choice(wanted: Sequence[Moment]) -> dict[str, float | int | bool | str | None]:
    """How good the choice was."""
    return {
        "best": _mean([look.revealed >= look.most for look in wanted]),
        "right": _mean([look.revealed >= RIGHT * look.most for look in wanted]),
        "missed": _mean([look.chosen == NO_VEHICLE for look in wanted]),
        "regret": _mean([1 - look.revealed / look.most for look in wanted]),
        "regret_unheard": _mean([1 - look.most_heard / look.most for look in wanted]),
        "heard": _ratio(sum(x.heard for x in wanted), sum(x.candidates for x in wanted)),
        "revealed_m2": _mean([look.revealed for look in wanted]),
        "told": _ratio(
            sum(look.told for look in wanted), sum(look.hidden_vehicles for look in wanted)
        ),
    }


def _mean(values: Sequence[float]) -> float | None:
    return float(np.mean(values)) if values else None


def _ratio(part: float, whole: float) -> float | None:
    return part / whole if whole else None


def _draw(axes: "Axes", table: Mapping[str, Array]) -> None:
    shown = {"all": "all together", "most": "the best", "revealed": "the chosen one"}
    lines = ("-.", "--", "-")
    for (name, label), colour, line in zip(shown.items(), COLOURS, lines, strict=False):
        axes.plot(table["time"], table[name], line, color=colour, label=label, lw=1.2)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("hidden road revealed [m$^2$]")
    axes.legend()
