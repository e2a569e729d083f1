"""`nlosim serve`."""

import logging
import sys
import threading
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Final

from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.errors import Problem, ScenarioError
from orchestrator.hosts_file import Hosts, read_hosts
from orchestrator.network import network
from orchestrator.placement import transport_type
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.transport import Transport
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.document import Document
from orchestrator.scenario.installed import scenario_path
from orchestrator.scenario.isolation import LOCAL, usual_transport
from orchestrator.scenario.model import Scenario
from orchestrator.serving.server import Server
from orchestrator.serving.stand import Stand
from orchestrator.suggestion import suggestion

_USUAL: Final = "hosts.yaml"
_PAUSE: Final = 0.5
"""How often to see whether somebody wants this to end [s]."""


def execute(arguments: Namespace) -> Outcome:
    """Serve until all is done (`--once`) or somebody wants it to end."""
    path = scenario_path(arguments.scenario)

    def load() -> Scenario:
        return load_scenario(path, arguments.overrides)

    scenario = load()
    hosts = read_hosts(_hosts_file(path, arguments.hosts))
    host, names = _chosen(scenario, hosts, arguments.host, arguments.components)
    say = _Speaker(is_json=arguments.json)
    with _quiet_log(), ExitStack() as stack:
        processes = stack.enter_context(_processes())
        stands = [Stand(name, load, processes) for name in names]
        for stand in stands:
            stack.callback(stand.close)
            stand.prepare()
        server = Server(stands, say)
        stack.enter_context(network().lobby(hosts, host, server))
        stack.enter_context(server)  # closed first: it tells the runs that use it
        listed = ", ".join(f"`{name}`" for name in names)
        say(f"{listed}: ready on host `{host}` ({hosts.endpoint(host)}); Ctrl-C ends it")
        return _until_done(server, names, once=arguments.once)


def _until_done(server: Server, names: Sequence[str], *, once: bool) -> Outcome:
    left, runs = set(names), 0
    problems: list[str] = []
    while left or not once:
        ended = server.next_end(_PAUSE)
        if ended is not None:
            runs += 1
            left.discard(ended[0])
            problems += [ended[1]] if ended[1] else []
    if problems:
        text = "\n".join(problems)
        return failure("served", Exit.COMPONENT_FAILED, text, text=f"error: {text}")
    return Outcome(text="all have been used", data={"served": list(names), "uses": runs})


class _Speaker:
    """Says one line at a time, from any thread; on standard error if `--json` is to be read."""

    def __init__(self, *, is_json: bool) -> None:
        self._lock = threading.Lock()
        self._is_json = is_json

    def __call__(self, line: str) -> None:
        with self._lock, suppress(OSError):
            stream = sys.stderr if self._is_json else sys.stdout
            stream.write(f"{line}\n")
            stream.flush()


@contextmanager
def _quiet_log() -> Iterator[None]:
    """Have components log what a run may want to know, and show warnings here."""
    root, terminal = logging.getLogger(), logging.StreamHandler()
    terminal.setLevel(logging.WARNING)
    level = root.level
    root.setLevel(logging.INFO)
    root.addHandler(terminal)
    try:
        yield
    finally:
        root.removeHandler(terminal)
        root.setLevel(level)


def _processes() -> Transport:
    """What makes the processes of components; values are not shared, because they travel."""
    usual = usual_transport()
    transport: Transport
    transport = LocalTransport(shares=False) if usual == LOCAL else transport_type(usual)()
    transport.open((), 60.0)
    return transport


def _hosts_file(scenario: Path, said: str | None) -> Path:
    if said is not None:
        return Path(said)
    usual = scenario.parent / _USUAL
    if usual.is_file():
        return usual
    what = f"there is no `{_USUAL}` beside the scenario, which says where to listen; use --hosts"
    raise _error(Document.read(scenario), what)


def _chosen(
    scenario: Scenario, hosts: Hosts, host: str | None, names: Sequence[str]
) -> tuple[str, tuple[str, ...]]:
    """Which host this is, and the components that it serves."""
    document, uses = scenario.document, scenario.components
    problems = [
        f"there is no component `{name}`; {suggestion(name, uses)}"
        for name in names
        if name not in uses
    ]
    if problems:
        raise _error(document, *problems)
    marked = list(dict.fromkeys(uses[name].host for name in names or uses if uses[name].host))
    if host is None:
        if len(marked) != 1:
            found = f"names {', '.join(f'`{each}`' for each in marked)}" if marked else "names none"
            raise _error(document, f"which host is this? the scenario {found}; use --host")
        host = marked[0]
    assert host is not None  # noqa: S101 - one was found
    try:
        hosts.endpoint(host)
    except ValueError as error:
        raise ScenarioError([Problem(hosts.document.key(("hosts",)), str(error))]) from None
    chosen = tuple(names) or tuple(name for name, use in uses.items() if use.host == host)
    if not chosen:
        raise _error(document, f"the scenario marks no component with `host: {host}`; name some")
    return host, tuple(dict.fromkeys(chosen))


def _error(document: Document, *problems: str) -> ScenarioError:
    where = document.key(("components",))
    return ScenarioError([Problem(where, f"components: {what}") for what in problems])
