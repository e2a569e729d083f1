"""What components of one run gave here, so that others of that run get it without being sent it.

Of each output the two newest values are kept: while the run works with one, the component may have
given the next.
"""

import threading
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from orchestrator.remote.block import NAMED, Entry, WireError, entries, replaced
from orchestrator.remote.naming import LEAST, Name
from orchestrator.remote.protocol import Kind, Message

_KEPT: Final = 2
_WITH_INPUTS: Final = {Kind.INITIALISE, Kind.EVALUATE, Kind.STEP}
_WITH_OUTPUTS: Final = {*_WITH_INPUTS, Kind.LOAD, Kind.SELECT}


class Shelf:
    """The values of one run."""

    def __init__(self) -> None:
        self._values: dict[tuple[str, int], OrderedDict[tuple[int, int], Entry]] = {}

    def fill(self, command: Message, message: bytes) -> bytes:
        """The command with the values that it names.

        Args:
            command: its header.
            message: all of it.

        Raises:
            WireError: there is no such value.
        """
        if command.kind not in _WITH_INPUTS:
            return message
        _, offset = Message.decode(message)
        found = list(entries(message, offset))
        if not any(entry.form == NAMED for entry in found):
            return message
        return replaced(message, offset, [self._value(entry) for entry in found])

    def keep(self, component: str, command: Message, reply: bytes) -> None:
        """Keep the values in the reply to a command."""
        if command.kind not in _WITH_OUTPUTS:
            return
        said, offset = Message.decode(reply)
        if said.kind is not Kind.DONE:
            return
        for entry in entries(reply, offset):
            if len(entry.body) >= LEAST:
                kept = self._values.setdefault((component, entry.number), OrderedDict())
                kept[said.epoch, said.sequence] = entry
                while len(kept) > _KEPT:
                    kept.popitem(last=False)

    def _value(self, entry: Entry) -> Entry:
        if entry.form != NAMED:
            return entry
        name = Name.decode(entry.content)
        kept = self._values.get((name.component, name.output))
        found = None if kept is None else kept.get((name.epoch, name.sequence))
        if found is None:
            raise WireError(f"the run names a value of `{name.component}` that is not here")
        return found._replace(number=entry.number)


class Shelves:
    """Those of all runs that are here, by a number that only the run knows."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._shelves: dict[str, tuple[Shelf, list[None]]] = {}

    @contextmanager
    def shelf(self, number: str) -> Iterator[Shelf]:
        """The shelf of a run; it is there as long as one of its components is used."""
        with self._lock:
            shelf, users = self._shelves.setdefault(number, (Shelf(), []))
            users.append(None)
        try:
            yield shelf
        finally:
            with self._lock:
                users.pop()
                if not users:
                    del self._shelves[number]
