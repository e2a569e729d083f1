"""Temporary folders that go when their process is gone, however it ended.

A process has one folder `nlosim-XXXXXXXX` in the system's folder for temporary files, and in it all
that it needs. It holds a lock on a file beside it (`nlosim-XXXXXXXX.lock`), which the system lets
go when the process ends. Whoever needs a folder removes those whose lock nobody holds: the number
of a process, which the system may have given to another one, plays no part in it.
"""

import contextlib
import os
import secrets
import shutil
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Final

if sys.platform != "win32":
    import fcntl

_PREFIX: Final = "nlosim-"
_LOCK: Final = ".lock"


class _Own:
    """The folder of this process, once it has one, and the lock on it."""

    def __init__(self) -> None:
        self.pid = 0
        self.folder = Path()
        self.lock = -1
        self.turn = threading.RLock()  # the garbage collector may discard one within another's turn
        self.is_needed = False  # whether somebody is about to have a folder in it


_OWN: Final = _Own()


def temporary_folder(purpose: str) -> Path:
    """A new folder for `purpose`, a part of its name; whoever asks for it discards it."""
    with _OWN.turn:
        _OWN.is_needed = True
        try:
            return Path(tempfile.mkdtemp(prefix=f"{purpose}-", dir=_folder()))
        finally:
            _OWN.is_needed = False


def discard(folder: Path) -> None:
    """Remove a folder that `temporary_folder` made; the process keeps none that is empty."""
    shutil.rmtree(folder, ignore_errors=True)
    with _OWN.turn:
        if not _OWN.is_needed:
            _leave()


@contextlib.contextmanager
def scratch(purpose: str) -> Iterator[Path]:
    """A temporary folder that is there while the block runs."""
    folder = temporary_folder(purpose)
    try:
        yield folder
    finally:
        discard(folder)


def sweep() -> None:
    """Remove the folders of processes of this user that are gone."""
    for lock in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*{_LOCK}"):
        with contextlib.suppress(OSError), _held(lock):
            folder = lock.with_suffix("")
            if folder.is_dir() and not folder.is_symlink():
                shutil.rmtree(folder)
            lock.unlink(missing_ok=True)


def _folder() -> Path:
    parent = Path(tempfile.gettempdir()).absolute()
    if _OWN.pid != os.getpid() or _OWN.folder.parent != parent or not _OWN.folder.is_dir():
        _leave()
        sweep()
        _OWN.folder, _OWN.lock = _claimed(parent)
        _OWN.pid = os.getpid()
    return _OWN.folder


def _claimed(parent: Path) -> tuple[Path, int]:
    """A new folder, and the open file whose lock says that it is in use."""
    while True:
        folder = parent / f"{_PREFIX}{secrets.token_hex(4)}"
        lock = Path(f"{folder}{_LOCK}")
        try:
            descriptor = os.open(lock, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
        except FileExistsError:
            continue
        if not _locked(descriptor) or not lock.exists():
            os.close(descriptor)  # somebody who sweeps took it for one that is left
            continue
        folder.mkdir(mode=0o700)
        return folder, descriptor


def _leave() -> None:
    """Let go of the folder of this process, if nothing is in it."""
    if _OWN.pid != os.getpid():
        return
    with contextlib.suppress(OSError):
        _OWN.folder.rmdir()
        _OWN.pid = 0
        os.close(_OWN.lock)
        Path(f"{_OWN.folder}{_LOCK}").unlink()


@contextlib.contextmanager
def _held(lock: Path) -> Iterator[None]:
    """Hold the lock of a folder that nobody uses.

    Raises:
        OSError: somebody does, or it is not ours.
    """
    if sys.platform == "win32":
        lock.unlink()  # refused as long as somebody has it open
        yield
        return
    descriptor = os.open(lock, os.O_RDWR | os.O_NOFOLLOW)
    try:
        if os.fstat(descriptor).st_uid != os.getuid() or not _locked(descriptor):
            raise PermissionError
        yield
    finally:
        os.close(descriptor)


def _locked(descriptor: int) -> bool:
    """Take the lock; whether it was free."""
    if sys.platform != "win32":
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
    return True
