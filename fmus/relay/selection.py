"""The base of relay policies: when a relay is chosen, and among whom, whatever the policy."""

import abc
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from fmus.relay.inputs import Inputs
from fmus.relay.nodes import Node
from fmus.relay.offers import Offers
from fmus.relay.situation import Choice, Situation
from fmus.relay.unit import RelayUnit
from fmus.relay.whereabouts import Whereabouts
from orchestrator.parameters import parameter
from orchestrator.share import share
from orchestrator.signal import Signals
from orchestrator.timebase import Duration, Time, nanoseconds


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectionParameters:
    """Parameters of every policy that can choose a relay."""

    window: float = parameter(2.0, unit="s", minimum=0.001, doc="time between re-selections")
    maximum_range: float = parameter(
        300.0, unit="m", minimum=1.0, doc="candidates with a longer hop are not considered"
    )
    lost_after: float = parameter(
        0.5, unit="s", minimum=0.001, doc="who was not heard for longer is no candidate or relay"
    )
    ego_range: float | None = parameter(
        None,
        unit="m",
        minimum=1.0,
        doc="candidates farther from the ego are not considered, 50 m is the reach of the paper's "
        "matrix; null: `maximum_range` alone",
    )
    offering: float = share(
        1.0,
        doc="share of the vehicles that offer to relay, which is optional (3GPP TS 38.306, clause "
        "5.9): drawn for each one by the seed, the same ones for every policy",
    )
    direct_threshold: float | None = parameter(
        None,
        unit="dBm",
        doc="a relay is looked for only while the ego receives the sharer more weakly, and else "
        "the direct link is taken (3GPP TS 38.300, clause 16.12.4); null: it always is",
    )


class RelaySelection(RelayUnit):
    """A relay policy: which neighbour, if any, forwards the sharer's data to the ego.

    Derive from it, say in `choose` which candidate is to be taken, and offer the class by an entry
    point in the group `orchestrator.components`; then a scenario can name it as the `type` of its
    component `relay`. `fmus.relay` has all names that this takes: this class, `Situation` and
    `Choice`. Everything else is the same for every policy, so that policies can be compared:

    * **Connectors.** All policies have the same; nothing is to be declared.
    * **Knowledge.** A policy knows what the ego can know: the ego's own state and detections, its
      map of the buildings, and the messages that it received. `Situation.known` has all of that
      and `Situation` what every policy needs of it. The simulator's truth is not offered.
    * **When.** `choose` is called when fusion is triggered for a sharer, again after each `window`,
      and at once when the relay has not been heard for `lost_after`; not while fusion is not
      triggered, and not for a sharer that was never heard: then the direct link is taken. With a
      `direct_threshold` it is called only when the ego receives the sharer more weakly than that,
      and at once when it begins to.
    * **Among whom.** `Situation.candidates` are the neighbours heard within `lost_after` whose two
      hops are at most `maximum_range` long, who are within `ego_range`, and who offer to relay
      (`offering`). There may be none.
    * **What is chosen** holds until the next choice. A choice that differs from the last for the
      same sharer counts as a switch.
    * **Parameters.** Those of `RelaySelection.Parameters`. A policy with more nests a frozen
      dataclass `Parameters` that derives from that one, and hands it to this constructor.
    * **State.** What a policy remembers from step to step it makes in `begin` and takes in by
      `remember`; both do nothing by default. A run may be repeated: `begin` forgets everything.
    * **Chance.** The only source of randomness is the generator given to `begin`.
    """

    Parameters: TypeAlias = SelectionParameters

    def __init__(self, parameters: SelectionParameters) -> None:
        self._selection = parameters

    @abc.abstractmethod
    def choose(self, situation: Situation) -> Choice:
        """The choice from now on.

        Args:
            situation: who is to be connected, and who could relay.

        Returns:
            One of the candidates, or `Choice()` for the direct link.
        """

    def begin(self, rng: np.random.Generator) -> None:
        """Enter the state at the start of a run, whatever was before.

        Args:
            rng: the policy's own random stream.
        """

    def remember(self, known: Inputs, now: Time) -> None:
        """Take in what the ego knows, at every communication point, before any choice there.

        Args:
            known: what the ego knows at `now`.
            now: the communication point [ns].
        """

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        super().setup(start, rng)
        self._whereabouts = Whereabouts()
        self._next_choice = start
        self._is_at_rest = False
        self._offers = Offers(self._selection.offering, rng)
        self.begin(rng)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        now, known = t + h, Inputs.read(inputs)
        self._whereabouts.update(known, now)
        self.remember(known, now)
        sharer = known.wanted_sharer
        if sharer == NO_VEHICLE:
            self._course.pause()
            return
        is_due = self._course.is_new(sharer) or now >= self._next_choice
        suffices = self._direct_link_suffices(known, sharer)
        is_woken = self._is_at_rest and not suffices
        if is_due or is_woken or self._relay_is_lost(known):
            choice = Choice() if suffices else self._chosen(known, sharer, now)
            self._course.take(choice, sharer)
            self._is_at_rest = suffices
            self._next_choice = now + nanoseconds(self._selection.window)

    def _chosen(self, known: Inputs, sharer: int, now: Time) -> Choice:
        current = None if self._course.is_new(sharer) else self._course.relay
        where = self._whereabouts.of(sharer, now)
        found = situation(known, where, current, self._selection, self._offers)
        choice = Choice() if found is None else self.choose(found)
        if not isinstance(choice, Choice):
            name, kind = type(self).__name__, type(choice).__name__
            raise TypeError(f"`{name}.choose` returned `{kind}`, not a `Choice`")
        return choice

    def _direct_link_suffices(self, known: Inputs, sharer: int) -> bool:
        """Whether the ego receives the sharer at the threshold or above; never without one."""
        least = self._selection.direct_threshold
        if least is None:
            return False
        return bool(known.links.power(np.array(sharer), np.array(known.ego.vehicle)) >= least)

    def _relay_is_lost(self, known: Inputs) -> bool:
        if self._course.relay == NO_VEHICLE:
            return False
        ages = known.bsms.age[known.bsms.vehicle == self._course.relay]
        return len(ages) == 0 or bool(ages[0] > self._selection.lost_after)


def situation(
    known: Inputs,
    sharer: Node | None,
    current: int | None,
    given: SelectionParameters,
    offers: Offers,
) -> Situation | None:
    """Who is to be connected, and the candidates for it; the same for every policy.

    Args:
        known: what the ego knows.
        sharer: where it was last known.
        current: as in `Situation`.
        given: which limits candidates have to keep.
        offers: who offers to relay.

    Returns:
        None if the sharer has never been heard: there is nothing to compare.
    """
    if sharer is None:
        return None
    ego, far = known.ego, given.maximum_range
    near = far if given.ego_range is None else min(given.ego_range, far)
    candidates = {
        vehicle: node
        for vehicle, node in known.bsms.heard_within(given.lost_after).items()
        if vehicle not in {sharer.vehicle, ego.vehicle}
        and sharer.distance(node) <= far
        and node.distance(ego) <= near
        and vehicle in offers
    }
    return Situation(ego=ego, sharer=sharer, candidates=candidates, current=current, known=known)
