"""The base of driving policies."""

import abc
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from typing_extensions import override

from fmus.driving.policy.command import Command
from fmus.driving.policy.connectors import POSE_ERROR, SENSED, connectors
from fmus.driving.policy.inputs import Inputs
from fmus.driving.policy.own_body import OwnBody
from orchestrator.component import Component
from orchestrator.signal import Connector, Signals
from orchestrator.timebase import Duration, Time


class DrivingPolicy(Component):
    """A driving policy: what the ego vehicle's pedals and wheel shall do.

    Derive from it, say in `reads` what it has to know and in `drive` what it does, and offer the
    class by an entry point in the group `orchestrator.components`; then a scenario can name it as
    the `type` of its component `policy`. `fmus.driving.policy` has all names that this takes: this
    class, `Inputs`, `Command`, the set `EGO` of the signals about the ego vehicle, and `follow`,
    which steers along the route. Everything else is the same for every policy:

    * **Connectors.** All policies have the same, so that one can take another's place.
    * **Knowledge.** Of the inputs a policy is given those in `reads`; its outputs are declared to
      depend on them. `Inputs` has everything else as if nothing were connected.
    * **Nobody brakes for himself.** What others saw of the ego vehicle is left out of the received
      objects (`OwnBody`). It takes the signals in `EGO`, by which the ego is known.
    * **Nobody is wrong about himself.** If vehicles are wrong about their poses, then all of
      `Inputs`, the ego and its route included, is where the ego believes it to be. So its own error
      cancels, but for what others tell it; what `drive` returns holds for the vehicle itself.
    * **When.** `drive` is called at every step; what it returns acts in the step that follows.
    * **Parameters.** None by default. A policy with parameters nests a frozen dataclass
      `Parameters`, of which its constructor takes an instance (`orchestrator.parameters`).
    * **State.** What a policy remembers from step to step it makes in `begin`, which does nothing
      by default. A run may be repeated: `begin` forgets everything.
    * **Chance.** The only source of randomness is the generator given to `begin`.
    """

    @property
    @abc.abstractmethod
    def reads(self) -> frozenset[str]:
        """Names of the inputs that the policy reads; constant after creation.

        They are those of `fmus.driving.policy.connectors.INPUTS`; `EGO` has those about the ego
        vehicle.
        """

    @abc.abstractmethod
    def drive(self, inputs: Inputs, now: Time) -> Command:
        """What pedals and wheel shall do from now on.

        Args:
            inputs: what the policy knows at `now`.
            now: the communication point at the end of the step [ns].
        """

    def begin(self, start: Time, rng: np.random.Generator) -> None:
        """Enter the state at the start of a run, whatever was before.

        Args:
            start: the first communication point [ns].
            rng: the policy's own random stream.
        """

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return connectors(_with_belief(self.reads))

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._outputs = Command().signals()
        self._own_body = OwnBody()
        self.begin(start, rng)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        now, known = t + h, Inputs.read(inputs, _with_belief(self.reads))
        self._own_body.update(known.ego, now)
        is_ego = self._own_body.is_in(known.received)
        if is_ego.any():
            known = replace(known, received=known.received.compress(~is_ego))
        command = self.drive(known, now)
        if not isinstance(command, Command):
            name, kind = type(self).__name__, type(command).__name__
            raise TypeError(f"`{name}.drive` returned `{kind}`, not a `Command`")
        self._outputs = command.signals()

    @override
    def outputs(self) -> Signals:
        return self._outputs


def _with_belief(reads: frozenset[str]) -> frozenset[str]:
    """What a policy says to read, and where the ego believes to be if that matters for it."""
    return reads | POSE_ERROR if reads & SENSED else reads
