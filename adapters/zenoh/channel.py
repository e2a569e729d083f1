"""The host's end: a Zenoh client whose main thread reads commands and answers them."""

import math
from time import monotonic, sleep
from typing import Final

import zenoh
from typing_extensions import override
from zenoh.handlers import FifoChannel

from adapters.zenoh.session import RETRY, Keys, close_session, is_matched, open_session
from orchestrator.remote.host import HostChannel

_CONNECT_TIMEOUT: Final = 30.0
"""How long the orchestrator may take to listen, and to subscribe to the replies [s]."""


class ZenohChannel(HostChannel):
    """Connects to the orchestrator's session, and again when the connection is lost.

    The orchestrator then says its last command once more. If that was carried out already, its
    reply is said once more, too: no command is carried out twice.

    Args:
        endpoint: where the orchestrator listens.
        run: the run's name in all keys.
        component: the component hosted here.
        user, password: what the orchestrator lets in.
        lease: how long either end may be silent [s].
    """

    def __init__(
        self, *, endpoint: str, run: str, component: str, user: str, password: str, lease: float
    ) -> None:
        keys = Keys(run, component)
        self._session = open_session(
            {
                "mode": "client",
                "connect/endpoints": [endpoint],
                "connect/timeout_ms": int(1000 * _CONNECT_TIMEOUT),
                "connect/retry": RETRY,
                "transport/link/tx/lease": int(1000 * lease),
                "transport/auth/usrpwd/user": user,
                "transport/auth/usrpwd/password": password,
            }
        )
        self._output = self._session.declare_publisher(
            keys.output, congestion_control=zenoh.CongestionControl.BLOCK, express=True
        )
        self._commands = self._session.declare_subscriber(keys.command, FifoChannel(8))
        self._command = self._reply = b""
        self._await_listener(_CONNECT_TIMEOUT)
        # last: whoever sees the token may rely on all of the above
        self._token = self._session.liveliness().declare_token(keys.alive(self._session.zid()))

    @override
    def receive(self) -> bytes:
        # a blocking read in the main thread is as fast as a callback, and larger messages are
        # reassembled meanwhile
        while (command := self._commands.recv().payload.to_bytes()) and command == self._command:
            self.send(self._reply)
        self._command = command
        return command

    @override
    def send(self, reply: bytes) -> None:
        self._reply = reply
        self._await_listener(math.inf)  # if the orchestrator is gone, so is this process soon
        self._output.put(reply)

    @override
    def close(self) -> None:
        close_session(self._session)

    def _await_listener(self, timeout: float) -> None:
        """Wait until replies find the orchestrator; sooner they would vanish silently."""
        deadline = monotonic() + timeout
        while not is_matched(self._output):
            if monotonic() > deadline:
                raise TimeoutError("the orchestrator does not listen to this component's replies")
            sleep(0.001)
