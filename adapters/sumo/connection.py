"""How SUMO is reached: in this process by libsumo, or elsewhere by TraCI.

Both offer the same modules (`vehicle`, `lane`, ...), with the same names and values, so nothing
else knows which it is. Only the cheapest way of reading many vehicles differs: getters in this
process, subscriptions over a socket, where every getter would be a round trip.
"""

import abc
import contextlib
import io
import logging
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, ClassVar, Final, Literal

from typing_extensions import override

from adapters.sumo.errors import SumoError
from adapters.sumo.headless import import_libsumo, with_stand_ins
from adapters.sumo.watching import Getters, Subscriptions, Watch
from orchestrator.timebase import NANOSECONDS_PER_SECOND, Duration, seconds

Program = Literal["libsumo", "sumo", "sumo-gui"]

_WAIT: Final = 0.1
"""The time between two attempts to reach a program [s]."""

_ATTEMPTS: Final = 600
"""How often a program just started is tried: it loads the net first."""

_TIME_TO_END: Final = 2.0
"""The time that a program has to end before it is told so more firmly [s]."""

_ATTEMPTS_TO_JOIN: Final = 20
"""How often one is tried that ought to run already."""

_NO_CLIENTS: Final = ("--remote-port", "0")
"""A configuration that names a port would have SUMO wait for a client before its first step."""

logger = logging.getLogger(__name__)


class Connection(abc.ABC):
    """A SUMO simulation that is ready for its first step.

    Attributes:
        modules: has SUMO's modules as attributes: `vehicle`, `lane`, `simulation`, ...
        refusal: what they raise when SUMO refuses.
    """

    modules: Any
    refusal: type[Exception]

    @abc.abstractmethod
    def step(self) -> None:
        """Advance by one step of SUMO."""

    @abc.abstractmethod
    def watch(self, module: Any, *, poses: bool = True, text: str | None = None) -> Watch:
        """Watch objects of a module: their poses, and a text by the name of its getter."""

    @abc.abstractmethod
    def reached(self) -> AbstractContextManager[None]:
        """Within it, a connection that breaks raises SumoError with a sentence."""

    @abc.abstractmethod
    def close(self) -> None:
        """End it. Calling it twice is harmless."""


class InProcess(Connection):
    """SUMO in this process. libsumo keeps its simulation in global variables: one per process.

    Args:
        options: of SUMO.

    Raises:
        SumoError: another simulation is open, or a mesoscopic one was; or SUMO refuses the files.

    Attributes:
        is_spent: whether libsumo 1.28 has simulated a mesoscopic scene in this process, and keeps
            some of it in its global variables.
    """

    is_spent: ClassVar[bool] = False

    def __init__(self, options: Sequence[str]) -> None:
        sumo = _libsumo()
        self.modules, self.refusal = sumo, sumo.TraCIException
        self._refusals = (sumo.TraCIException, sumo.FatalTraCIError)
        if InProcess.is_spent:
            raise SumoError(
                "SUMO has simulated a mesoscopic scene (`mesosim`) in this process and does not "
                "forget it: lanes of bicycles would be closed to them; start another process"
            )
        if sumo.simulation.isLoaded():
            raise SumoError(
                "SUMO can run once per process, and it is running already; give all but one "
                "`sumo-traffic` component `program: sumo`, or mark them `process: true`; or "
                "close the other one first"
            )
        try:
            sumo.start(["sumo", *options, *_NO_CLIENTS])
        except self._refusals as error:
            sumo.close()  # or what it has loaded so far would be in the way of the next one
            raise SumoError(_cannot_load(options, error)) from error
        self._is_closed = False

    @override
    def step(self) -> None:
        try:
            self.modules.simulationStep()
        except self._refusals as error:
            raise SumoError(f"SUMO gave up: {error}") from error

    @override
    def watch(self, module: Any, *, poses: bool = True, text: str | None = None) -> Watch:
        return Getters(module, text)

    @override
    def reached(self) -> AbstractContextManager[None]:
        return contextlib.nullcontext()

    @override
    def close(self) -> None:
        if not self._is_closed:
            self._is_closed = True
            if self.modules.simulation.getOption("mesosim") == "true":
                InProcess.is_spent = True
            self.modules.close()


class OverTraci(Connection):
    """SUMO in another process, or on another host, over TraCI.

    Args:
        connection: of the package `traci`.
        process: of SUMO, if it was started for this.
        where: for messages.
    """

    def __init__(self, connection: Any, process: Any, where: str) -> None:
        import traci.exceptions as failures  # noqa: PLC0415 - see `_traci`

        self.modules, self.refusal = connection, failures.TraCIException
        self._lost = (failures.FatalTraCIError, OSError)
        self._process = process
        self._where = where
        self._is_closed = False

    @override
    def step(self) -> None:
        try:
            self.modules.simulationStep()
        except self.refusal as error:
            raise SumoError(f"SUMO gave up: {error}") from error

    @override
    def watch(self, module: Any, *, poses: bool = True, text: str | None = None) -> Watch:
        return Subscriptions(module, poses=poses, text=text)

    @override
    @contextlib.contextmanager
    def reached(self) -> Iterator[None]:
        try:
            yield
        except self._lost as error:
            raise SumoError(f"SUMO at {self._where} is gone: {error}") from error

    @override
    def close(self) -> None:
        if self._is_closed:
            return
        self._is_closed = True
        with contextlib.suppress(self.refusal, *self._lost):
            self.modules.close(wait=False)
        if self._process is not None:
            _end(self._process)


def start(program: Program, options: Sequence[str]) -> Connection:
    """Start SUMO.

    Args:
        program: `libsumo` for this process, or a program that is installed.
        options: of SUMO.

    Raises:
        SumoError: it cannot start, or refuses the files.
    """
    if program == "libsumo":
        return InProcess(options)
    traci = _traci()
    path = _installed(program)
    extra = ["--start", "true", "--quit-on-end", "true"] if program == "sumo-gui" else []
    port = int(traci.getFreeSocketPort())
    command = [path, *options, *extra, "--remote-port", str(port), "--num-clients", "1"]
    environment = with_stand_ins(os.environ) if program == "sumo" else None
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, env=environment
    )
    try:
        connection = _reach(traci, "localhost", port, process)
    except BaseException:
        process.kill()
        process.wait()
        raise
    return OverTraci(connection, process, f"localhost:{port}")


def is_address(text: str) -> bool:
    """Whether a text is `HOST:PORT`."""
    host, _, port = text.rpartition(":")
    return bool(host) and port.isdecimal() and 0 < int(port) < 65536


def join(address: str, step_length: Duration) -> Connection:
    """Join a SUMO that runs already.

    Args:
        address: `HOST:PORT` of its `--remote-port`; see `is_address`.
        step_length: the step that SUMO must have [ns].

    Raises:
        SumoError: nobody answers there, or it steps otherwise.
    """
    traci = _traci()
    host, _, port = address.rpartition(":")
    connection = OverTraci(_reach(traci, host, int(port), None), None, address)
    found = round(connection.modules.simulation.getDeltaT() * NANOSECONDS_PER_SECOND)
    if found != step_length:
        connection.close()
        raise SumoError(
            f"SUMO at {address} steps every {found / 1e9:g} s, the scenario every "
            f"{seconds(step_length):g} s; start SUMO with --step-length {seconds(step_length):g} "
            f"or set `step_length` to {found / 1e9:g} s"
        )
    return connection


def _libsumo() -> Any:
    """The package `libsumo`, imported where it is needed.

    What it prints then goes to the log: that another version of Arrow is installed than the one it
    is linked with, which it brings along.
    """
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        libsumo = import_libsumo()
    if printed.getvalue():
        logger.debug("libsumo: %s", " ".join(printed.getvalue().split()))
    return libsumo


def _traci() -> Any:
    """The package `traci`, imported where it is needed: it looks for libsumo, too."""
    if find_spec("traci") is None:
        raise SumoError("the package `traci` is not installed; run `pip install traci`")
    import traci  # noqa: PLC0415 - optional

    return traci


def _reach(traci: Any, host: str, port: int, process: Any) -> Any:
    """A connection of `traci`; a `process` that ends meanwhile is not waited for."""
    attempts = _ATTEMPTS if process is not None else _ATTEMPTS_TO_JOIN
    try:
        with contextlib.redirect_stdout(sys.stderr if process is None else io.StringIO()):
            found = traci.connect(port, attempts, host, proc=process, waitBetweenRetries=_WAIT)
            found.simulation.getTime()  # it answers once it has loaded its files
            return found
    except (traci.exceptions.FatalTraCIError, traci.exceptions.TraCIException, OSError) as error:
        if process is not None:
            raise SumoError(
                f"SUMO did not start: {error} (SUMO's own message is on standard error)"
            ) from error
        raise SumoError(
            f"no SUMO answers at {host}:{port} ({error}); start one with `sumo -c FILE.sumocfg "
            f"--remote-port {port}`"
        ) from error


def _installed(program: str) -> str:
    """The path of one of SUMO's programs: of the package eclipse-sumo, SUMO_HOME, or PATH."""
    folders = []
    spec = find_spec("sumo")
    if spec is not None and spec.origin is not None:
        folders.append(Path(spec.origin).parent / "bin")
    if "SUMO_HOME" in os.environ:
        folders.append(Path(os.environ["SUMO_HOME"]) / "bin")
    for folder in folders:
        found = shutil.which(program, path=str(folder))
        if found is not None:
            return found
    found = shutil.which(program)
    if found is None:
        raise SumoError(
            f"`{program}` is not installed; run `pip install eclipse-sumo`, or install SUMO and "
            "set SUMO_HOME"
        )
    return found


def _end(process: Any) -> None:
    """Wait for a process that is to end; it writes its files to their ends first."""
    for insist in (process.terminate, process.kill):
        try:
            process.wait(timeout=_TIME_TO_END)
        except subprocess.TimeoutExpired:
            insist()
    process.wait()


def _cannot_load(options: Sequence[str], error: Exception) -> str:
    config = options[options.index("--configuration-file") + 1]
    return f"SUMO cannot load `{config}`: {error} (SUMO's own message is on standard error)"
