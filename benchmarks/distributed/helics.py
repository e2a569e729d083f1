"""HELICS: a federate in each process and a broker in one more, ZeroMQ between them.

`python -m benchmarks.distributed.helics broker MEMBERS` says where it listens, and ends with the
federates. `... federate ADDRESS RING STEPS NUMBER` says whether its values were right and, the
first one, when its steps began.
"""

import contextlib
import importlib
import json
import socket
import sys
from collections.abc import Sequence
from time import perf_counter_ns
from typing import Any, Final

import numpy as np
from typing_extensions import override

from benchmarks.distributed.children import BrokenProcessError, ended, hear, killed, spawn
from benchmarks.distributed.participant import Participant, missing
from benchmarks.distributed.ring import PARALLEL, Ring

_OFFSET: Final = 1 / 128
"""The part of a step between the turns of two members, when they take turns."""
_PORTS: Final = range(24_000, 32_000)
"""Ports below those that Linux gives to connections."""
_BROKERS_PORTS: Final = 8
"""Ports of the broker itself: two, and some before those of the federates."""


class Helics(Participant):
    """Value federates, which publish arrays as bytes."""

    label = "HELICS"
    most = 20

    @property
    @override
    def why_not(self) -> str:
        return missing("helics", "helics")

    @override
    def stamps(self, ring: Ring, steps: int) -> Sequence[int]:
        server = spawn(__name__, ["broker", ring.members])
        with killed([server]):  # it would take seconds to see that it is alone
            address = hear(server)["address"]
            federates = [
                spawn(__name__, ["federate", address, ring.to_text(), steps, number])
                for number in range(ring.members)
            ]
            with ended(federates):
                said = [hear(federate) for federate in federates]
        ring.check(self.label, [each["right"] for each in said], steps)
        found: Sequence[int] = said[0]["stamps"]
        return found


def first_free_port(count: int) -> int:
    """The first of `count` free ports in a row, none of which the system gives to connections.

    HELICS takes the ports behind that of its broker, two for each federate, and fails if one of
    them belongs to a connection, or did so a minute ago.

    Raises:
        BrokenProcessError: there are not so many.
    """
    for first in range(_PORTS.start, _PORTS.stop - count, count):
        with contextlib.ExitStack() as opened, contextlib.suppress(OSError):
            for port in range(first, first + count):
                opened.enter_context(socket.socket()).bind(("127.0.0.1", port))
            return first
    raise BrokenProcessError(f"there are no {count} free ports in a row in {_PORTS}")


def broker(members: int) -> None:
    """Be the broker of so many federates."""
    helics: Any = importlib.import_module("helics")
    port = first_free_port(2 * members + _BROKERS_PORTS)
    options = f"-f {members} --port={port} --localport={port} --consoleloglevel=no_print"
    made = helics.helicsCreateBroker("zmq", f"broker-{port}", options)
    print(json.dumps({"address": helics.helicsBrokerGetAddress(made)}), flush=True)  # noqa: T201
    helics.helicsBrokerWaitForDisconnect(made, -1)
    helics.helicsCloseLibrary()


def federate(address: str, ring: Ring, steps: int, number: int) -> None:
    """Be one member."""
    helics: Any = importlib.import_module("helics")
    turn = 0.0 if ring.algorithm == PARALLEL else number * _OFFSET
    info = helics.helicsCreateFederateInfo()
    info.core_type = "zmq"
    info.core_init = f"--federates=1 --brokeraddress={address} --consoleloglevel=no_print"
    helics.helicsFederateInfoSetTimeProperty(info, helics.HELICS_PROPERTY_TIME_PERIOD, 1.0)
    if turn:
        helics.helicsFederateInfoSetTimeProperty(info, helics.HELICS_PROPERTY_TIME_OFFSET, turn)
    # a value that comes does not make it step before its time
    helics.helicsFederateInfoSetFlagOption(info, helics.HELICS_FLAG_UNINTERRUPTIBLE, 1)
    made = helics.helicsCreateValueFederate(f"member-{number}", info)
    output = helics.helicsFederateRegisterGlobalPublication(
        made, f"y{number}", helics.HELICS_DATA_TYPE_RAW, ""
    )
    before = (number - 1) % ring.members
    input_ = helics.helicsFederateRegisterSubscription(made, f"y{before}", "")
    helics.helicsFederateEnterExecutingMode(made)
    value = ring.start(number)
    helics.helicsPublicationPublishBytes(output, value.tobytes())
    stamps = []
    for step in range(1, steps + 1):
        stamps.append(perf_counter_ns())
        helics.helicsFederateRequestTime(made, step + turn)
        value = np.frombuffer(helics.helicsInputGetBytes(input_), np.float64) + 1.0
        helics.helicsPublicationPublishBytes(output, value.tobytes())
    stamps.append(perf_counter_ns())
    said = {"right": ring.is_last(number, value, steps), "stamps": [] if number else stamps}
    print(json.dumps(said), flush=True)  # noqa: T201
    helics.helicsFederateDisconnect(made)
    helics.helicsFederateFree(made)
    helics.helicsCloseLibrary()


if __name__ == "__main__":
    if sys.argv[1] == "broker":
        broker(int(sys.argv[2]))
    else:
        federate(sys.argv[2], Ring.from_text(sys.argv[3]), *map(int, sys.argv[4:]))
