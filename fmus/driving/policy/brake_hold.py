"""Keeping to the brake, for a driver that remembers nothing of what it did."""

from collections import deque
from dataclasses import replace

from fmus.driving.policy.command import Command
from orchestrator.timebase import Duration, Time


class BrakeHold:
    r"""Commands with the greatest brake of the last moments in place of their own.

    Of brakes $b_k$ at $t_k$ the one at $t$ is $\max \{b_k : t - d \le t_k \le t\}$, a running
    maximum. A duration $d$ of zero changes nothing.

    Args:
        duration: for how long what was braked is kept to, at least [ns].
    """

    def __init__(self, duration: Duration) -> None:
        self._duration = duration
        self._greatest: deque[tuple[Time, float]] = deque()  # falling: who is less and older is out

    def held(self, command: Command, now: Time) -> Command:
        """The command with the greatest brake of the last moments; then nothing accelerates.

        Args:
            command: of now; `hazard` stays as it is.
            now: not before that of the call before [ns].
        """
        if self._duration == 0:
            return command
        while self._greatest and self._greatest[-1][1] <= command.brake:
            self._greatest.pop()
        self._greatest.append((now, command.brake))
        while now - self._greatest[0][0] > self._duration:
            self._greatest.popleft()
        brake = self._greatest[0][1]
        if brake == command.brake:
            return command
        return replace(command, accelerate=0.0, brake=brake)
