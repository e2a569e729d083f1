"""Serving components to runs on other hosts, one run after the other for each of them.

The component is created here, from the scenario and the files that are here: of what a run says, no
code is taken, nor the name of any, nor a value of a parameter.
"""

import logging
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from queue import Empty, SimpleQueue
from time import monotonic
from types import TracebackType
from typing import Any, Final, Self

from typing_extensions import override

from orchestrator.errors import CosimError, in_words
from orchestrator.network import Reception, Visit
from orchestrator.remote.output import PRINTS
from orchestrator.remote.patience import LONGEST_SLICE, SLICE
from orchestrator.remote.protocol import Kind, Message
from orchestrator.remote.transport import LinkLostError
from orchestrator.serving.shelf import Shelf, Shelves
from orchestrator.serving.stand import Ready, Stand
from orchestrator.statement import Statement, differences
from orchestrator.timebase import Time, seconds

_LONGEST_PATIENCE: Final = 24 * 3600.0
"""How long a run that was cut off is waited for at most, whatever it asks for [s]."""

_SUSPICIOUS: Final = 0.5
"""How long nothing is known of a run before that is worth a word [s]."""

_LISTENED: Final = 2.0
"""How long to wait until a run has heard that it was left [s]."""

STOPPED: Final = "`nlosim serve` was stopped"


class _Use:
    """One run that uses one component."""

    def __init__(self, request: Mapping[str, Any], visit: Visit, statement: Statement) -> None:
        self.number = request.get("run")
        self.shelf = str(request.get("shelf", self.number))[:100]
        self.statement = statement
        self.run = str(request.get("name", "unknown"))[:100]
        self.visit = visit
        self.time: Time | None = None
        self.reached: Time | None = None
        self.is_set_up = False
        with suppress(TypeError, ValueError):
            self.patience = min(float(request.get("patience", 60.0)), _LONGEST_PATIENCE)

    patience = 60.0

    @property
    def when(self) -> str:
        """From which simulated time the component works, as text."""
        return _at(self.time)

    def answer(self, request: Mapping[str, Any]) -> Mapping[str, Any]:
        """What is said to whoever asks for the component meanwhile."""
        if self.number == request.get("run"):  # it did not hear that it is welcome
            said = self.statement.to_document()
            return {"statement": said, "accepted": True, "again": True}
        absence = self.visit.absence
        lost = f", not heard for {absence:.0f} s" if absence else ""
        return {"wait": f"the run `{self.run}` has it{self.when}{lost}"}

    def note(self, command: Message) -> None:
        """Note how far the run has come."""
        if command.kind in (Kind.SETUP, Kind.STEP):
            self.is_set_up = True
            self.time, self.reached = command.t, command.t + command.h


class _Prints(logging.Handler):
    """Hands on what the process of a component prints to the run that uses it."""

    def __init__(self, uses: Mapping[str, _Use]) -> None:
        super().__init__()
        self._uses = uses

    @override
    def emit(self, record: logging.LogRecord) -> None:
        name = record.args[0] if isinstance(record.args, tuple) and record.args else None
        use = self._uses.get(str(name))
        if use is not None:
            use.visit.log([(record.name, record.levelno, record.getMessage())])


class Server(Reception):
    """Serves components until it is closed, which is before its lobby is.

    Args:
        stands: the components; each is prepared.
        say: is called with a line whenever something happens; from any thread.
    """

    def __init__(self, stands: Sequence[Stand], say: Callable[[str], None]) -> None:
        self._stands = {stand.name: stand for stand in stands}
        self._say = say
        self._uses: dict[str, _Use] = {}
        self._ends: SimpleQueue[tuple[str, str]] = SimpleQueue()
        self._threads: list[threading.Thread] = []
        self._coming = threading.Lock()  # who comes while this closes is refused, or waited for
        self._is_closing = False
        self._prints = _Prints(self._uses)
        self._shelves = Shelves()

    def __enter__(self) -> Self:
        logger = logging.getLogger(PRINTS)
        logger.addHandler(self._prints)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        with self._coming:
            self._is_closing = True
        for thread in self._threads:
            thread.join()
        for stand in self._stands.values():
            stand.close()
        logging.getLogger(PRINTS).removeHandler(self._prints)

    @property
    @override
    def names(self) -> tuple[str, ...]:
        return tuple(self._stands)

    def next_end(self, timeout: float) -> tuple[str, str] | None:
        """The next component whose run has ended, and what went wrong; `None` if none does.

        Args:
            timeout: how long to wait [s].
        """
        with suppress(Empty):
            return self._ends.get(timeout=timeout)
        return None

    @override
    def meet(self, component: str, request: Mapping[str, Any]) -> Mapping[str, Any]:
        stand, run = self._stands[component], str(request.get("name", "unknown"))[:100]
        if self._is_closing:
            return {"wait": STOPPED}
        if component in self._uses:
            return self._uses[component].answer(request)
        try:
            made = self._current(stand)
        except CosimError as error:
            return {"refused": [f"its scenario is wrong there: {error}"]}
        if made is None:
            problem = stand.problem
            if not problem:
                return {"wait": "it is being created"}
            stand.prepare_aside()  # it may be mended by the next time
            return {"refused": [f"it cannot be created there: {problem}"]}
        there = Statement.from_document(request.get("statement") or {})
        unlike = differences(made.statement, there)
        if unlike:
            self._say(f"`{component}`: refused the run `{run}`: {'; '.join(unlike)}")
        verdict = {"refused": unlike} if unlike else {"accepted": True}
        return {"statement": made.statement.to_document(), **verdict}

    def _current(self, stand: Stand) -> Ready | None:
        """The component as its scenario and its files are now; `None` until it is created.

        Raises:
            CosimError: the scenario is wrong by now.
        """
        if stand.ready is not None and not stand.is_current():
            self._say(f"`{stand.name}`: its scenario or its files have changed; created anew")
            made = stand.take()
            stand.prepare_aside()
            if made is not None:
                made.end()
        return stand.ready

    @override
    def welcome(self, component: str, request: Mapping[str, Any], visit: Visit) -> bool:
        with self._coming:
            made = None if self._is_closing else self._stands[component].take()
            if made is None:
                visit.close()
                return False
            use = self._uses[component] = _Use(request, visit, made.statement)
            thread = threading.Thread(
                target=self._attend, args=(component, use, made), name=component, daemon=True
            )
            self._threads = [each for each in self._threads if each.is_alive()] + [thread]
            thread.start()
        return True

    def _attend(self, component: str, use: _Use, made: Ready) -> None:
        """Be at the service of one run, to its end."""
        self._say(f"`{component}`: the run `{use.run}` has come")
        problem = ""
        try:
            with self._shelves.shelf(use.shelf) as shelf:
                self._serve(component, use, made, shelf)
            self._say(f"`{component}`: the run `{use.run}` has ended{_at(use.reached)}")
        except _GoneError as error:
            problem = f"`{component}`: the run `{use.run}` is gone{use.when}: {error}"
        except Exception as error:  # lost; also by a defect: the run is not left waiting
            how = str(error) if isinstance(error, CosimError) else in_words(error)
            problem = f"`{component}` was lost{use.when}: {how}"
            self._lose(use, how)
        if problem:
            self._say(problem)
        made.end()  # what it printed is read to the end, for the run
        use.visit.close()
        if not self._is_closing:
            self._stands[component].prepare_aside()
        del self._uses[component]
        if use.is_set_up or problem:
            self._ends.put((component, problem))

    def _serve(self, component: str, use: _Use, made: Ready, shelf: Shelf) -> None:
        """Hand commands to the component and its replies to the run.

        Raises:
            LinkLostError: the component is gone, or this server is to stop.
            WireError: the run speaks something else.
            _GoneError: the run is gone.
        """
        is_told = False
        while True:
            if self._is_closing:  # also while one command comes on the heels of another
                raise LinkLostError(STOPPED)
            try:
                raw = use.visit.receive(SLICE)
            except TimeoutError:
                is_told = self._look(component, use, is_told=is_told)
                with suppress(TimeoutError):
                    made.link.receive(0.0)
                continue
            if not raw:
                return
            command, _ = Message.decode(raw)
            use.note(command)
            if command.kind is Kind.CREATE:
                use.visit.send(made.answer(command))
                continue
            made.link.send(shelf.fill(command, raw))
            reply = None
            while reply is None and not use.visit.is_over:
                try:
                    reply = made.link.receive(SLICE)
                except TimeoutError:
                    is_told = self._look(component, use, is_told=is_told)
            if reply is None:
                return
            shelf.keep(component, command, reply)
            use.visit.send(reply)

    def _look(self, component: str, use: _Use, *, is_told: bool) -> bool:
        """See whether the run is there, and this server is to go on; whether it was told."""
        if self._is_closing:
            raise LinkLostError(STOPPED)
        absence = use.visit.absence
        if absence > use.patience:
            raise _GoneError(f"nothing was heard of it for {use.patience:g} s")
        if (absence > _SUSPICIOUS) == is_told:
            return is_told
        lost = f"lost the connection to the run `{use.run}`{use.when}"
        back = f"the run `{use.run}` is there again"
        waiting = f"{lost}; it is waited for, for {use.patience:g} s"
        self._say(f"`{component}`: {back if is_told else waiting}")
        return not is_told

    def _lose(self, use: _Use, how: str) -> None:
        """Tell the run that the component is lost, until it has heard it or is gone."""
        use.visit.lose(how)
        waited = 0.0
        patience = _LISTENED if self._is_closing else use.patience
        while not use.visit.is_over and waited < patience and use.visit.absence < patience:
            before = monotonic()
            with suppress(TimeoutError):
                if not use.visit.receive(SLICE):
                    return
                use.visit.lose(how)  # it asks again
            waited += min(monotonic() - before, LONGEST_SLICE)
            patience = _LISTENED if self._is_closing else use.patience


def _at(time: Time | None) -> str:
    return "" if time is None else f" at t = {seconds(time):.9g} s"


class _GoneError(CosimError):
    """A run is not heard of any more."""
