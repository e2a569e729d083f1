"""One host as the orchestrator sees it: its process, and the line to it."""

from collections.abc import Mapping
from time import monotonic
from typing import Any

import zenoh
from typing_extensions import override

from adapters.zenoh.channel import ZenohChannel
from adapters.zenoh.line import Event, Line, News
from adapters.zenoh.session import Keys
from orchestrator.errors import ComponentError
from orchestrator.remote.patience import Patience
from orchestrator.remote.process import HostProcess
from orchestrator.remote.transport import LinkLostError, ProcessLink


class ZenohLink(ProcessLink):
    """The link to one host. Declares its keys and spawns its process; does not wait for it.

    Args:
        session: the orchestrator's.
        keys: of this component in this run.
        component: its name.
        options: arguments of `ZenohChannel`.
        admits: what the host may create.
    """

    def __init__(
        self,
        session: zenoh.Session,
        keys: Keys,
        component: str,
        options: Mapping[str, Any],
        admits: str,
    ) -> None:
        self._component = component
        self._obituary = ""
        self._line = Line(session, keys, component, "its process")
        self._process = HostProcess(component, ZenohChannel, options, self._line.end, admits=admits)

    def await_connection(self, patience: Patience) -> None:
        """Wait until commands and replies will both arrive.

        Args:
            patience: how long.

        Raises:
            ComponentError: the process ended, or is not there in time.
        """
        try:
            while (event := self._line.await_connection(patience))[0] is News.DISCONNECTED:
                pass
        except TimeoutError:
            said = self._process.last_words()
            what = f"its process was not ready in time{said}"
            raise ComponentError(self._component, None, what) from None
        try:
            self._check(event)
        except LinkLostError as error:
            raise ComponentError(self._component, None, str(error)) from None

    @override
    def send(self, message: bytes) -> None:
        if self._obituary:
            raise LinkLostError(self._obituary)
        self._line.send(message)

    @property
    @override
    def packs(self) -> bool:
        return True

    @override
    def receive(self, timeout: float) -> bytes:
        deadline = monotonic() + timeout
        if self._obituary:
            raise LinkLostError(self._obituary)
        while True:
            event = self._line.next(deadline - monotonic())
            if event[0] is News.REPLY:
                return event[1]
            self._check(event)

    @property
    @override
    def condition(self) -> str:
        return "" if self._line.lost_for is None else "the connection to its process is lost"

    @override
    def abandon(self) -> None:
        self._process.kill()
        self._obituary = self._obituary or "its process was ended by the orchestrator"

    @override
    def dismiss(self) -> None:
        if not self._obituary:
            self._line.send(b"")

    def _check(self, event: Event) -> None:
        """Raise `LinkLostError` at the end of the host."""
        if event[0] is News.ENDED:
            self._obituary = self._process.obituary()
        if self._obituary:
            raise LinkLostError(self._obituary)
