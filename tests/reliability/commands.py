"""What a command in this process said, and whether that is documented."""

import contextlib
import io
import os
import re
import sys
import tempfile
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from orchestrator.cli import main

_FORM: Final = re.compile(
    r"^(error: |usage: |interrupted|there is not enough memory|\S.*:\d+:\d+: | +\"message\": )",
    re.MULTILINE,
)
_MOST: Final = 1_000_000


@dataclass(frozen=True, slots=True)
class Said:
    """The end of a command.

    Attributes:
        code: its exit code; negative: the signal that ended it.
        text: what it wrote, to standard output and error.
    """

    code: int
    text: str

    def fault(self, allowed: Collection[int] = (0, 2)) -> str:
        """What is not as it is documented, in a line; empty if all is."""
        if "Traceback (most recent call last)" in self.text:
            return f"a traceback: {self._last()}"
        if self.code not in allowed:
            return f"exit code {self.code}: {self._last()}"
        if self.code == 2 and not _FORM.search(self.text):
            return f"exit code 2 without a message in the documented form: {self._last()}"
        return ""

    def _last(self) -> str:
        """The last lines, as one."""
        return " | ".join(self.text.strip().splitlines()[-3:])[-300:]


def nlosim(arguments: Sequence[str]) -> Said:
    """Run a command here."""
    with told() as text:
        try:
            code = main(arguments)
        except SystemExit as end:  # help
            code = int(end.code or 0)
    return Said(code, "".join(text))


@contextlib.contextmanager
def told() -> Iterator[list[str]]:
    """Keep what is written to standard output and error, also by libraries; it is in the list."""
    found: list[str] = []
    with tempfile.TemporaryFile() as file:
        streams = sys.stdout, sys.stderr
        saved = os.dup(1), os.dup(2)
        own = io.TextIOWrapper(os.fdopen(os.dup(file.fileno()), "wb"), write_through=True)
        try:
            sys.stdout = sys.stderr = own
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
            yield found
        finally:
            sys.stdout, sys.stderr = streams
            own.close()
            for number, kept in zip((1, 2), saved, strict=True):
                os.dup2(kept, number)
                os.close(kept)
            file.seek(0)
            found.append(file.read(_MOST).decode(errors="replace"))
