"""The files of a hosts file's credentials: those that are missing are made, no other is written."""

import os
import stat
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Final

from adapters.keys.authority import Authority, Identity, UnreadableError, expiry
from orchestrator.errors import Problem, ScenarioError
from orchestrator.hosts_file import AUTHORITY, KEY, RUN, Hosts

_PRIVATE: Final = 0o600
_PUBLIC: Final = 0o644


@dataclass(frozen=True, slots=True, kw_only=True)
class Made:
    """The credentials of one party.

    Attributes:
        name: of a host, `RUN`, or `AUTHORITY`.
        files: its certificate and its key.
        is_new: whether they were made just now; else they were there.
        until: when the certificate ends to be valid.
    """

    name: str
    files: tuple[Path, Path]
    is_new: bool
    until: datetime


def make_credentials(hosts: Hosts, now: datetime, days: int) -> list[Made]:
    """Make what is missing of the credentials of a hosts file, or nothing at all.

    Args:
        hosts: of the file.
        now: the time of day; certificates are valid from here on.
        days: how long those of hosts and of the run are valid [d].

    Returns:
        What there is now: the authority, the run, and the hosts in the order of the file.

    Raises:
        ScenarioError: the file names no folder, or what is there does not fit; all problems.
        OSError: a file cannot be written.
    """
    folder = _folder(hosts)
    authority, is_new = _authority(hosts, folder, now)
    addresses = _addresses(hosts)
    if problems := list(_unfit(hosts, authority, addresses, now)):
        raise ScenarioError(problems)
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if is_new:
        _write(_files(folder, AUTHORITY), authority.identity())
    made = [_made(folder, AUTHORITY, is_new=is_new)]
    for name, address in addresses.items():
        files = _files(folder, name)
        is_new = not files[0].exists()
        if is_new:
            _write(files, authority.issue(name, address, now, days))
        made.append(_made(folder, name, is_new=is_new))
    return made


def _folder(hosts: Hosts) -> Path:
    if hosts.folder is None:
        what = "the file names no folder for them; write `credentials: keys`"
        raise ScenarioError([Problem(hosts.document.value(()), what)])
    return hosts.folder


def _addresses(hosts: Hosts) -> Mapping[str, str | None]:
    """Every party, and the address under which others connect to it."""
    endpoints = hosts.endpoints.items()
    return {RUN: None, **{name: endpoint.bare_address for name, endpoint in endpoints}}


def _files(folder: Path, name: str) -> tuple[Path, Path]:
    return folder / f"{name}.pem", folder / f"{name}{KEY}.pem"


def _authority(hosts: Hosts, folder: Path, now: datetime) -> tuple[Authority, bool]:
    """The authority that is there, or a new one, and whether it is new."""
    certificate, key = _files(folder, AUTHORITY)
    if not certificate.exists() and not key.exists():
        return Authority.new(now), True
    if not key.exists():
        why = "is missing; certificates are made where the authority was made"
    elif not certificate.exists():
        why = f"is here, but `{certificate.name}` is not"
    else:
        _protect(key)
        try:
            return Authority.read(Identity(certificate.read_bytes(), key.read_bytes())), False
        except UnreadableError as error:
            why = str(error)
    where = hosts.document.value(("credentials",))
    raise ScenarioError([Problem(where, f"credentials: `{key}` {why}")])


def _unfit(
    hosts: Hosts, authority: Authority, addresses: Mapping[str, str | None], now: datetime
) -> Iterator[Problem]:
    """What is there, and cannot be what is needed."""
    assert hosts.folder is not None  # noqa: S101 - asked for before
    again = "move it and its key away to have them made again"
    for name, address in addresses.items():
        certificate, key = _files(hosts.folder, name)
        at = ("credentials",) if name == RUN else ("hosts", name)
        where = hosts.document.value(at) if name == RUN else hosts.document.key(at)
        if not certificate.exists() and not key.exists():
            continue
        if not certificate.exists():
            why = "is missing, but its key is here; move that away"
        elif not key.exists():
            why = f"is here, but its key is not; {again}"
        else:
            _protect(key)
            why = authority.why_not(certificate.read_bytes(), name, address, now)
            why = why and f"{why}; {again}"
        if why:
            yield Problem(where, f"{'.'.join(at)}: `{certificate}` {why}")


def _protect(key: Path) -> None:
    """Take a key that others could read away from them: what they have read, they have."""
    if sys.platform != "win32" and stat.S_IMODE(key.stat().st_mode) & ~_PRIVATE:
        key.chmod(_PRIVATE)


def _write(files: tuple[Path, Path], identity: Identity) -> None:
    """Write a key and its certificate; neither is there, or this is an error."""
    certificate, key = files
    _create(key, identity.key, _PRIVATE)
    _create(certificate, identity.certificate, _PUBLIC)


def _create(path: Path, content: bytes, mode: int) -> None:
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
    with os.fdopen(descriptor, "wb") as file:
        file.write(content)


def _made(folder: Path, name: str, *, is_new: bool) -> Made:
    files = _files(folder, name)
    return Made(name=name, files=files, is_new=is_new, until=expiry(files[0].read_bytes()))
