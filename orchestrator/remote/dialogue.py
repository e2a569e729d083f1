"""Commands to the hosts of a run, and their replies; whoever waits for one host hears of all.

Waiting is done in slices (`orchestrator.remote.patience`). Between two of them the other hosts are
looked at, so that one that died is named at once and not when its turn comes.
"""

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from time import monotonic
from types import MappingProxyType
from typing import Any, Final, NamedTuple, NoReturn

from typing_extensions import Buffer

from orchestrator.errors import ComponentError, ComponentTypeError, in_words
from orchestrator.remote.block import WireError
from orchestrator.remote.patience import LONGEST_SLICE, SLICE
from orchestrator.remote.protocol import Kind, Message
from orchestrator.remote.sharing import SharedMemory
from orchestrator.remote.transport import Link, LinkLostError
from orchestrator.timebase import Duration, Time

_log = logging.getLogger(__name__)

_LIMITED: Final = {Kind.CREATE, Kind.SETUP, Kind.EVALUATE, Kind.INITIALISE, Kind.STEP}
"""Commands that users can give more time."""


_MALFORMED: Final = (LookupError, TypeError, ValueError, AttributeError)
"""What comes of reading a document that is not what was agreed."""


class HostLostError(ComponentError):
    """The host of a component is gone, or does not answer; the component itself raised nothing."""


class Reply(NamedTuple):
    """The reply to a command; a tuple, like the message in it.

    Attributes:
        message: its header and its document.
        raw: all of it.
        offset: where its block of signals begins in `raw` [byte].
    """

    message: Message
    raw: bytes
    offset: int


class Company:
    """The dialogues of one launch."""

    def __init__(self) -> None:
        self._members: list[Dialogue] = []

    def join(self, dialogue: "Dialogue") -> None:
        """Have `dialogue` watched from now on."""
        self._members.append(dialogue)

    def spend(self, time: float) -> None:
        """Count `time` [s] that was waited towards the deadlines of all commands."""
        for each in self._members:
            each.waited += min(time, LONGEST_SLICE)

    def look_around(self, waiting: "Dialogue", command: Message) -> None:
        """Raise what became of the others while `waiting` awaits the reply to `command`.

        While components are created, all of them are asked in turn anyway: the first is named.
        """
        if command.kind is Kind.CREATE:
            return
        for each in self._members:
            if each is not waiting:
                each.overhear(command)


class Dialogue:
    """Commands to one host and its replies, told apart by epoch and sequence number.

    Args:
        name: of the component.
        link: to its host.
        company: it joins.

    Attributes:
        epoch: of the run; replies of an earlier one do not count.
        awaiting: the command that was not answered yet.
        waited: how long it was waited for [s].
        is_renewable: whether a loss of the host is told in its turn only, not to others.
        sequence: number of the last command.
        before_listening: called before others listen to this host: what compiled code has begun
            there is awaited here from then on, see `carry_on`.
    """

    def __init__(self, name: str, link: Link, company: Company) -> None:
        self.name = name
        self.epoch = 0
        self.awaiting: Message | None = None
        self.waited = 0.0
        self._allowed = 0.0
        self._link = link
        self.sequence = 0
        self._is_over = False
        self._came: Reply | None = None
        self._loss: HostLostError | None = None
        self.is_renewable = False
        self.before_listening: Callable[[], None] = _nothing
        self._company = company
        company.join(self)

    @property
    def memory(self) -> SharedMemory:
        """What the host sees, too."""
        return self._link.memory

    @property
    def site(self) -> str:
        """Where the host is, see `Link.site`."""
        return self._link.site

    @property
    def descriptor(self) -> int | None:
        """That of the socket to the host, see `Link.descriptor`."""
        return self._link.descriptor

    @property
    def packs(self) -> bool:
        """Whether steps without descriptions are worth while, see `Link.packs`."""
        return self._link.packs

    @property
    def is_over(self) -> bool:
        """Whether the host can no longer be asked anything."""
        return self._is_over

    def ask(
        self,
        kind: Kind,
        within: float,
        *,
        t: Time = 0,
        h: Duration = 0,
        document: Mapping[str, Any] = MappingProxyType({}),
        block: Sequence[Buffer] = (),
    ) -> int:
        """Send a command that is to be answered `within` some time [s]; its sequence number."""
        if self._loss is not None:
            self._tell_loss()
        if self._is_over:
            raise ComponentError(self.name, None, "its process has ended")
        self.sequence += 1
        command = Message(kind, self.epoch, self.sequence, t, h, document)
        self.awaiting, self._came = command, None
        self.waited, self._allowed = 0.0, within
        try:
            self._link.send(command.encode(block))
        except LinkLostError as error:
            self._fail(command, str(error))
        return self.sequence

    def carry_on(self, within: float, *, t: Time, h: Duration, sequence: int, came: bytes) -> None:
        """Await the reply to a step that was begun elsewhere.

        Args:
            within: how long from now on [s].
            t: where the step starts [ns].
            h: its length [ns].
            sequence: the number of the command.
            came: what was read of the reply.
        """
        self.sequence = sequence
        self.awaiting = Message(Kind.STEP, self.epoch, sequence, t, h)
        self._came, self.waited, self._allowed = None, 0.0, within
        self._link.unread(came)

    def say(self, message: bytes) -> None:
        """Send a command of who counts them and awaits the reply himself.

        Raises:
            LinkLostError: the host is gone.
        """
        self._link.send(message)

    def hear(self, timeout: float) -> bytes:
        """The next reply, for who sent the command by `say`.

        Args:
            timeout: how long to wait [s].

        Raises:
            TimeoutError: none came in time.
            LinkLostError: the host is gone.
        """
        return self._link.receive(timeout)

    def take_in(self, raw: bytes) -> None:
        """A reply that `hear` gave is the one that is awaited now; others are dropped."""
        assert self.awaiting is not None  # noqa: S101 - `carry_on` was called
        self._sort(self.awaiting, lambda: raw)

    def answer(self, timeout: float | None = None) -> Reply:
        """Wait for the reply to the command sent last; raise what the component raised.

        Args:
            timeout: how long to wait from now on, whatever becomes of others [s]; without, as
                long as `ask` allowed, and no longer than all others are well.
        """
        if self._loss is not None:
            self._tell_loss()
        command = self.awaiting
        if command is None:
            raise RuntimeError("`answer` without `ask`")
        if timeout is not None:
            self.waited, self._allowed = 0.0, timeout
        while self._came is None:
            before, left = monotonic(), self._allowed - self.waited
            self._listen(command, min(SLICE, max(0.0, left)))
            if self._came is not None:
                break
            if left <= 0:
                self._expire(command)
            self._company.spend(monotonic() - before)
            if timeout is None:
                self._company.look_around(self, command)
        return self._take(command)

    def has_answered(self) -> bool:
        """Whether `answer` would give a reply at once; a loss is told in its turn, or to others."""
        command = self.awaiting
        if command is None or self._loss is not None:
            return False
        if self._came is None:
            try:
                self._listen(command, 0.0)
            except HostLostError as error:
                self._loss = error
        return self._came is not None and self._came.message.kind is Kind.DONE

    def overhear(self, other: Message) -> None:
        """Look what this host does while another one works on `other`; raise what went wrong.

        An error of the component itself is raised only if its step ends no later than that of
        the other one: what comes of a step beyond the end of the run is ignored.
        """
        if not self.is_renewable:
            self._tell_loss()
        if self._is_over:
            return
        try:
            self._overhear(other)
        except HostLostError as error:
            if not self.is_renewable:
                raise
            self._loss = error

    def renew(self, link: Link) -> None:
        """Go on with another host, which knows nothing yet."""
        self._link, self._is_over = link, False
        self.awaiting, self._came, self._loss = None, None, None

    def _tell_loss(self) -> None:
        if self._loss is not None:
            loss, self._loss = self._loss, None
            raise loss

    def _overhear(self, other: Message) -> None:
        self.before_listening()
        command = self.awaiting
        if self._came is None:
            self._listen(other if command is None else command, 0.0)
        if command is None:
            return
        came = self._came
        if came is None:
            if self.waited > self._allowed:
                self._expire(command)
        elif came.message.kind is Kind.FAILED and _ends_by(command, other):
            self._take(command)

    def abandon(self) -> None:
        """End the host by force, once."""
        if not self._is_over:
            self._is_over = True
            self.awaiting = None
            self._link.abandon()

    def _listen(self, command: Message, timeout: float) -> None:
        """Wait up to `timeout` [s] for the reply to `command`; others are dropped."""
        self._sort(command, lambda: self._link.receive(timeout))

    def _sort(self, command: Message, receive: Callable[[], bytes]) -> None:
        try:
            raw = receive()
            message, offset = Message.decode(raw)
        except TimeoutError:
            return
        except LinkLostError as error:
            self._fail(command, str(error))
        except WireError as error:
            self._fail(command, f"its process sent something unreadable: {error}")
        is_answer = message.sequence == command.sequence and message.epoch == command.epoch
        if is_answer and command is self.awaiting:
            self._came = Reply(message, raw, offset)
        else:
            _log.debug("`%s`: dropped an earlier reply: %s", self.name, message)

    def _take(self, command: Message) -> Reply:
        reply, self._came, self.awaiting = self._came, None, None
        assert reply is not None  # noqa: S101 - whoever takes it knows that it came
        if reply.message.document or reply.message.kind is not Kind.DONE:
            with self.reading(command):
                _replay(self.name, reply.message.document.get("logs", ()))
                if reply.message.kind is not Kind.DONE:
                    self._raise(command, reply.message.document["failure"])
        return reply

    @contextmanager
    def reading(self, command: Message | None = None) -> Iterator[None]:
        """Read what the host said; that it says what was agreed is not taken for granted.

        Args:
            command: what it answered, for the time in the message.

        Raises:
            HostLostError: it is not what was agreed; the host is ended.
        """
        try:
            yield
        except (WireError, *_MALFORMED) as error:
            what = in_words(error) if isinstance(error, _MALFORMED) else error
            self._fail(command, f"its process sent something unreadable: {what}")

    def _expire(self, command: Message) -> NoReturn:
        doing = command.kind.name.lower()
        allowed = "; its `deadline` allows no more" if command.kind in _LIMITED else ""
        why = f"; {self._link.condition}" if self._link.condition else ""
        what = f"did not answer within {self._allowed:g} s (to `{doing}`){allowed}{why}"
        self._fail(command, what)

    def _fail(self, command: Message | None, text: str) -> NoReturn:
        self.abandon()
        time = None if command is None else _time_of(command)
        raise HostLostError(self.name, time, text) from None

    def _raise(self, command: Message, failure: Mapping[str, Any]) -> NoReturn:
        _log.info("`%s`: traceback in its host:\n%s", self.name, failure["traceback"])
        if failure["is_type_error"]:
            raise ComponentTypeError(failure["text"])
        time = _time_of(command) if failure["time"] is None else failure["time"]
        component = failure["component"] or self.name
        raise ComponentError(component, time, failure["text"], failure.get("where", ""))


def _nothing() -> None:
    pass


def _time_of(command: Message) -> Time | None:
    """The simulated time a command works from, if it says so."""
    return command.t if command.kind in (Kind.SETUP, Kind.STEP) else None


def _ends_by(command: Message, other: Message) -> bool:
    """Whether both are steps, and `command` ends no later than `other`."""
    are_steps = command.kind is other.kind is Kind.STEP
    return are_steps and command.t + command.h <= other.t + other.h


def _replay(component: str, records: Sequence[tuple[str, int, str]]) -> None:
    """Log here what a host logged."""
    for name, level, text in records:
        logger = logging.getLogger(name)
        if logger.isEnabledFor(level):
            record = logger.makeRecord(name, level, component, 0, text, (), None)
            record.processName = component
            logger.handle(record)
