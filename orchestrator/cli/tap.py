"""`nlosim tap`."""

import shutil
import sys
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from time import monotonic
from typing import IO, Final

from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.errors import CosimError
from orchestrator.remote.block import WireError
from orchestrator.suggestion import suggestion
from orchestrator.tap.client import TapClient
from orchestrator.tap.place import FILE, NoTapError, Place
from orchestrator.tap.stream import Reader, append, messages
from orchestrator.tap.table import Table

_RUNS: Final = Path("runs")
_REDRAW: Final = 0.1
"""The shortest time between two pictures of the table [s]."""

_HOME, _CLEAR_LINE, _CLEAR_BELOW = "\x1b[H", "\x1b[K", "\x1b[J"


class BadStreamError(CosimError):
    """A recorded stream cannot be read. Exit code 2."""


def execute(arguments: Namespace) -> Outcome:
    """Show a table, on a terminal again and again, elsewhere at the end."""
    table, reader = Table(arguments.keys), Reader()
    screen = _Screen(sys.stdout) if sys.stdout.isatty() and not arguments.json else None
    where = _found(arguments.run)
    count = 0
    interrupted = False
    with ExitStack() as stack:
        record = None
        if arguments.record is not None:
            record = stack.enter_context(Path(arguments.record).open("xb"))
        try:
            for raw in stack.enter_context(_stream(where, arguments)):
                table.take(reader.decode(raw), reader.schema)
                _check(table, arguments.keys)
                count += 1
                if record is not None:
                    append(record, raw)
                if screen is not None:
                    screen.draw(table)
        except KeyboardInterrupt:
            interrupted = True  # the usual way to stop looking
        except WireError as error:
            raise BadStreamError(f"`{where}`: {error}") from None
    data = {**table.data(), "messages": count}
    if arguments.record is not None:
        data["record"] = str(arguments.record)
    lines = table.lines(*_size()) if screen is None else []
    if not table.ending and table.schema is not None:
        lines.append("looked no more" if interrupted else "the run goes on")
    if arguments.record is not None:
        lines.append(f"{count} messages in {arguments.record}")
    return Outcome(text="\n".join(lines), data=data, exit_code=Exit.DONE)


def _check(table: Table, keys: Sequence[str]) -> None:
    """Refuse to look at nothing."""
    if keys and table.schema is not None and set(table.unknown) == set(keys):
        asked = ", ".join(f"`{key}`" for key in keys)
        said = keys[0].partition(".")[0]
        hint = suggestion(said, table.schema.components)
        what = f"no signal of `{table.schema.run}` is called {asked}, or matches"
        raise CosimError(f"{what}; of its components, {hint}")


@contextmanager
def _stream(where: Path, arguments: Namespace) -> Iterator[Iterator[bytes]]:
    """The messages of a run, or of a file."""
    if where.is_file():
        with where.open("rb") as file:
            yield messages(file)
        return
    place = Place.read(where)
    with TapClient(place, arguments.keys or ["*"], arguments.rate) as client:
        yield client.messages(arguments.seconds)


def _found(said: str | None) -> Path:
    """The run that is meant: the newest one with a tap, unless it is said."""
    if said is not None:
        path = Path(said)
        if not path.exists():
            raise NoTapError(f"there is no `{said}`, neither a run directory nor a file")
        return path
    offers = sorted(_RUNS.glob(f"*/{FILE}"), key=lambda file: file.stat().st_mtime)
    if not offers:
        what = f"no run in `{_RUNS}` has a tap; start one with `nlosim run --tap`, or name its"
        raise NoTapError(f"{what} directory")
    return offers[-1].parent


def _size() -> tuple[int, int]:
    """Columns and lines for the table."""
    if sys.stdout.isatty():
        size = shutil.get_terminal_size()
        return size.columns, size.lines - 1
    return 200, 100_000


class _Screen:
    """Draws a table over the one before."""

    def __init__(self, stream: IO[str]) -> None:
        self._stream = stream
        self._drawn = 0.0
        self._is_clear = False

    def draw(self, table: Table) -> None:
        now = monotonic()
        if now - self._drawn < _REDRAW and not table.ending:
            return
        self._drawn = now
        begin = _HOME if self._is_clear else f"{_HOME}\x1b[2J"
        self._is_clear = True
        lines = table.lines(*_size())
        text = "".join(f"{line}{_CLEAR_LINE}\n" for line in lines)
        self._stream.write(f"{begin}{text}{_CLEAR_BELOW}")
        self._stream.flush()
