"""States of FMUs as bytes that can leave the process."""

import json
import struct
import weakref
from collections.abc import Callable, Mapping
from typing import Any, Final, Protocol

from typing_extensions import override

from adapters.fmi.description import FmuDescription
from adapters.fmi.errors import FmuError
from adapters.fmi.instance import FmuInstance
from adapters.fmi.state import FmuState
from orchestrator.capabilities import PortableState
from orchestrator.remote.block import WireError
from orchestrator.remote.wire import SignalDecoder, SignalEncoder
from orchestrator.signal import Causality, Connector, Signals

_MAGIC: Final = b"nlosim FMU state 1\n"
_LENGTHS: Final = struct.Struct("<4Q")  # of the header, the inputs, the outputs, what the FMU says


class StateOwner(Protocol):
    """The component whose states are dumped."""

    @property
    def connectors(self) -> Mapping[str, Connector]:
        """The signals that it exchanges, by name."""

    def save(self) -> FmuState:
        """Its state."""

    def restore(self, state: FmuState) -> None:
        """Return to `state`."""


class PortableFmu(PortableState):
    """A state of an FMU, with what the importer knew (FMI 2.0.4, 2.1.8; FMI 3.0.2, 2.2.7.4).

    Args:
        description: of the FMU.
        owner: the component.
        instance: the running one.
    """

    def __init__(
        self, description: FmuDescription, owner: StateOwner, instance: Callable[[], FmuInstance]
    ) -> None:
        self._description = description
        self._owner = owner
        self._instance = instance

    @override
    def dump(self) -> bytes:
        state = self._owner.save()
        header = {"fmu": self._description.token, "lengths": dict(state.lengths)}
        parts = [
            json.dumps(header).encode(),
            _block(self._of(Causality.INPUT), state.written),
            _block(self._of(Causality.OUTPUT), state.read),
            self._instance().serialize(state.address),
        ]
        return b"".join((_MAGIC, _LENGTHS.pack(*map(len, parts)), *parts))

    @override
    def load(self, content: bytes) -> None:
        header, written, read, rest = _parts(content)
        token = self._description.token
        if header["fmu"] != token:
            raise FmuError(f"the state is one of the FMU {header['fmu']}, not of {token}")
        instance = self._instance()
        try:
            inputs = SignalDecoder(self._of(Causality.INPUT)).decode(written)
            outputs = SignalDecoder(self._of(Causality.OUTPUT)).decode(read)
        except WireError as error:
            raise FmuError(
                f"the state has other connectors than this component: {error}"
            ) from error
        state = FmuState(
            instance=instance,
            address=instance.deserialize(rest),
            lengths=header["lengths"],
            written=inputs,
            read=outputs,
        )
        weakref.finalize(state, instance.forget, state.address)
        self._owner.restore(state)

    def _of(self, causality: Causality) -> dict[str, Connector]:
        return {n: c for n, c in self._owner.connectors.items() if c.causality is causality}


def _block(connectors: Mapping[str, Connector], signals: Signals) -> bytes:
    return b"".join(SignalEncoder(connectors).parts(signals))


def _parts(content: bytes) -> tuple[dict[str, Any], bytes, bytes, bytes]:
    """The header and the three other parts of a dumped state."""
    start = len(_MAGIC) + _LENGTHS.size
    if content[: len(_MAGIC)] != _MAGIC or len(content) < start:
        raise FmuError("these bytes are no state of an FMU")
    lengths = _LENGTHS.unpack_from(content, len(_MAGIC))
    if start + sum(lengths) != len(content):
        raise FmuError(f"the state is cut: it has {len(content)} of {start + sum(lengths)} bytes")
    found = []
    for length in lengths:
        found.append(content[start : start + length])
        start += length
    return json.loads(found[0]), *found[1:]
