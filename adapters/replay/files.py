"""Files as bytes, compressed or not."""

import gzip
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Final, cast

from adapters.replay.findings import Findings

GZIP: Final = ".gz"


def kind_of(path: Path) -> str:
    """The suffix that tells the format of a file: that before `.gz`, in lower case."""
    name = path.name.lower().removesuffix(GZIP)
    return Path(name).suffix


def opened(path: Path) -> IO[bytes]:
    """The bytes of a file, uncompressed.

    Raises:
        OSError: it cannot be opened.
    """
    if path.name.lower().endswith(GZIP):
        return cast("IO[bytes]", gzip.open(path, "rb"))
    return path.open("rb")


@contextmanager
def noting_faults(findings: Findings) -> Iterator[None]:
    """Within it, that a file cannot be opened or read on is noted, and ends the reading."""
    try:
        yield
    except (EOFError, zlib.error) as error:
        findings.note((1, 1), f"is a damaged gzip file: {error}")
    except OSError as error:
        findings.note((1, 1), f"cannot be read: {error.strerror or error}")
