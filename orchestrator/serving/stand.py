"""One served component: its process, kept ready for the next run, and what is said of it."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace

from orchestrator.errors import ComponentError, CosimError, ScenarioError, in_words
from orchestrator.placement import spec_of
from orchestrator.remote.admission import digest_of
from orchestrator.remote.declarations import connectors_from_message
from orchestrator.remote.dialogue import Company, Dialogue, Reply
from orchestrator.remote.protocol import Kind, Message
from orchestrator.remote.transport import GRACE, Link, ProcessLink, Transport
from orchestrator.scenario.absent import absence
from orchestrator.scenario.model import ComponentUse, Scenario
from orchestrator.statement import Statement, described, statement


@dataclass(frozen=True, slots=True, kw_only=True)
class Ready:
    """A component that exists and that no run uses yet.

    Attributes:
        link: to its process.
        created: how it answered when it was created.
        statement: what is said of it.
    """

    link: Link
    created: Reply
    statement: Statement

    def answer(self, command: Message) -> bytes:
        """The reply to a command to create the component, which was done before."""
        said = self.created.message
        reply = command.reply(said.kind, said.document)
        return reply.encode([self.created.raw[self.created.offset :]])

    def end(self) -> None:
        """End the process: in its own way, if it takes no longer than `GRACE`."""
        if isinstance(self.link, ProcessLink):
            self.link.dismiss()
            self.link.has_left(GRACE)
        self.link.abandon()


class Stand:
    """A component as its scenario says it, created before anybody asks for it.

    Args:
        name: of the component.
        load: reads the scenario, anew each time.
        processes: makes the process that the component is in.
    """

    def __init__(self, name: str, load: Callable[[], Scenario], processes: Transport) -> None:
        self.name = name
        self._load = load
        self._processes = processes
        self._lock = threading.Lock()
        self._ready: Ready | None = None
        self._problem = ""
        self._making: Link | None = None
        self._maker: threading.Thread | None = None
        self._is_closed = False

    @property
    def ready(self) -> Ready | None:
        """The component; `None` while it is being created, and if it cannot be."""
        return self._ready

    @property
    def problem(self) -> str:
        """Why it cannot be created; empty if nothing is known to be wrong."""
        return self._problem

    def prepare(self) -> None:
        """Create the component.

        Raises:
            ScenarioError: the scenario is wrong, or does not have the component.
            ComponentTypeError: it refuses its parameters.
            ComponentError: its process did not start, or died.
        """
        use, scenario = self._read()
        said = statement(scenario, self.name)  # before: what changes meanwhile is found out later
        create, document = use.limits.deadlines.create, spec_of(use).to_document()
        self._processes.admit({self.name: digest_of(document)})
        link = self._processes.renew(self.name, create)
        try:
            self._note(link)
            link.limit_memory(use.limits.memory)
            dialogue = Dialogue(self.name, link, Company())
            dialogue.ask(Kind.CREATE, create, document=document)
            created = dialogue.answer()
            found = connectors_from_message(created.message.document, created.raw, created.offset)
            logged = {k: v for k, v in created.message.document.items() if k != "logs"}
            quiet = created._replace(message=created.message._replace(document=logged))
            made = Ready(
                link=link, created=quiet, statement=replace(said, connectors=described(found))
            )
        except BaseException:
            link.abandon()
            raise
        finally:
            self._making = None
        with self._lock:
            self._ready, self._problem = made, ""

    def prepare_aside(self) -> None:
        """Create the component in another thread; what is wrong is said in `problem`."""

        def work() -> None:
            try:
                self.prepare()
            except CosimError as error:
                self._problem = str(error)
            except Exception as error:  # a defect of the component, or of this program
                self._problem = in_words(error)

        self._problem = ""
        with self._lock:
            if not self._is_closed:
                name = f"{self.name} creation"
                self._maker = threading.Thread(target=work, name=name, daemon=True)
                self._maker.start()

    def is_current(self) -> bool:
        """Whether the component is still what its scenario and its files say.

        Raises:
            ScenarioError: the scenario is wrong by now.
        """
        made = self._ready
        if made is None:
            return False
        _, scenario = self._read()
        now = statement(scenario, self.name)
        return replace(made.statement, connectors=None) == now

    def take(self) -> Ready | None:
        """The component, for one run; it has to be prepared anew for the next one."""
        with self._lock:
            made, self._ready = self._ready, None
        return made

    def close(self) -> None:
        """End the process of a component that no run has taken, and its creation if that goes on.

        It is waited for: a thread that is in native code when Python ends takes the process along.
        """
        with self._lock:
            self._is_closed = True
            making, maker = self._making, self._maker
        if making is not None:
            making.abandon()
        if maker is not None:
            maker.join()
        made = self.take()
        if made is not None:
            made.end()

    def _note(self, link: Link) -> None:
        """Have `close` end what is being created."""
        with self._lock:
            self._making = link
            if self._is_closed:
                raise ComponentError(self.name, None, "it is not served any more")

    def _read(self) -> tuple[ComponentUse, Scenario]:
        scenario = self._load()
        use = scenario.components[self.name]
        problems = absence(scenario.document, self.name, use.type, use.host)
        if problems:
            raise ScenarioError(problems)
        return use, scenario
