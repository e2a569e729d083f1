"""Where a tap is: a file of the run directory, which only who started the run can read."""

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from orchestrator.errors import CosimError

FILE: Final = "tap.json"


class NoTapError(CosimError):
    """A run cannot be looked at. Exit code 2."""


@dataclass(frozen=True, slots=True)
class Place:
    """The address of a tap.

    Attributes:
        port: on 127.0.0.1.
        token: whoever knows it may look; every user of the machine can connect.
    """

    port: int
    token: str

    @property
    def url(self) -> str:
        """The address, as a browser takes it."""
        return f"ws://127.0.0.1:{self.port}/tap?token={self.token}"

    def write(self, directory: Path) -> None:
        """Write the file into the directory of a run."""
        fresh = directory / f"{FILE}.new"
        fresh.unlink(missing_ok=True)
        descriptor = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            json.dump({"url": self.url, "port": self.port, "token": self.token}, file)
        fresh.replace(directory / FILE)  # who looks for the file finds all of it, or none

    @classmethod
    def read(cls, directory: Path) -> "Place":
        """What `write` wrote.

        Raises:
            NoTapError: there is none.
        """
        try:
            said = json.loads((directory / FILE).read_text(encoding="utf-8"))
            return cls(int(said["port"]), str(said["token"]))
        except FileNotFoundError:
            what = f"`{directory}` has no tap; a run has one that goes on, with `nlosim run --tap`"
            raise NoTapError(what) from None
        except (OSError, ValueError, LookupError, TypeError) as error:
            raise NoTapError(f"`{directory / FILE}` cannot be read: {error}") from None
