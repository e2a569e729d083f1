"""Hosts files: under which addresses the hosts of a scenario are reached, and who they are.

    credentials: keys            # folder beside this file: authority.pem, NAME.pem, NAME-key.pem
    hosts:
      gpu: {endpoint: "tls/10.0.0.3:7447"}
      partner: {endpoint: "tcp/127.0.0.1:7448"}

Without TLS only loopback addresses are taken, unless `insecure: true` is written at the host.
"""

import ipaddress
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Final, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
from typing_extensions import override

from orchestrator.errors import Problem, ScenarioError
from orchestrator.scenario import diagnosis
from orchestrator.scenario.document import Address, Document
from orchestrator.suggestion import suggestion

RUN: Final = "run"
"""The name of the run in credentials: `run.pem`, `run-key.pem`. No host has it."""

AUTHORITY: Final = "authority"
"""The name of who signs, in credentials. No host has it."""

KEY: Final = "-key"
"""The end of the name of a file with a key. The name of no host ends so."""

NAME: Final = r"^[A-Za-z0-9_][A-Za-z0-9_-]*$"
"""What the name of a host looks like."""

_ENDPOINT: Final = re.compile(r"(tcp|tls)/(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+):([0-9]{1,5})")
_EXAMPLE: Final = "write e.g. `tls/10.0.0.3:7447`"


@dataclass(frozen=True, slots=True)
class HostEndpoint:
    """Where a host listens.

    Attributes:
        protocol: `tls`, or `tcp`, which is not encrypted.
        address: a name, or an IP address; IPv6 in brackets.
        port: 1 to 65535.
    """

    protocol: Literal["tcp", "tls"]
    address: str
    port: int

    @classmethod
    def parse(cls, text: str) -> "HostEndpoint":
        """What `tls/10.0.0.3:7447` means.

        Raises:
            ValueError: with a sentence.
        """
        found = _ENDPOINT.fullmatch(text)
        if found is None or not 1 <= int(found[3]) <= 65535:
            raise ValueError(f'"{text}" is not an endpoint; {_EXAMPLE}')
        protocol: Literal["tcp", "tls"] = "tls" if found[1] == "tls" else "tcp"
        return cls(protocol, found[2], int(found[3]))

    @property
    def bare_address(self) -> str:
        """The address without brackets."""
        return self.address.strip("[]")

    @property
    def is_loopback(self) -> bool:
        """Whether nobody outside of this machine reaches it."""
        try:
            return ipaddress.ip_address(self.bare_address).is_loopback
        except ValueError:
            return self.address == "localhost"

    @override
    def __str__(self) -> str:
        return f"{self.protocol}/{self.address}:{self.port}"


@dataclass(frozen=True, slots=True)
class Credentials:
    """The files by which one party proves who it is, and checks others.

    Attributes:
        authority: the certificate that signed those of all.
        certificate, key: its own, PEM.
    """

    authority: Path
    certificate: Path
    key: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Hosts:
    """What a hosts file says.

    Attributes:
        path: of the file.
        folder: with the credentials; `None`: there are none.
        endpoints: of all hosts, by name, in the order of the file.
        document: where everything was written.
    """

    path: Path
    folder: Path | None
    endpoints: Mapping[str, HostEndpoint]
    document: Document = field(repr=False, compare=False)

    def endpoint(self, name: str) -> HostEndpoint:
        """Where the host called `name` listens.

        Raises:
            ValueError: there is no such host; the sentence says which there are.
        """
        if name not in self.endpoints:
            hint = suggestion(name, self.endpoints)
            raise ValueError(f"there is no host `{name}` in {self.path}; {hint}")
        return self.endpoints[name]

    def credentials(self, name: str) -> Credentials | None:
        """The credentials of a host, or of `RUN`; `None` if the file names none.

        Raises:
            ScenarioError: a file of them is missing; at `credentials` in the hosts file.
        """
        if self.folder is None:
            return None
        found = Credentials(
            authority=self.folder / f"{AUTHORITY}.pem",
            certificate=self.folder / f"{name}.pem",
            key=self.folder / f"{name}{KEY}.pem",
        )
        files = (found.authority, found.certificate, found.key)
        if missing := [file for file in files if not file.is_file()]:
            where = self.document.value(("credentials",))
            raise ScenarioError(
                [Problem(where, f"credentials: there is no file `{each}`") for each in missing]
            )
        return found


def _endpoint(value: object) -> HostEndpoint:
    if isinstance(value, HostEndpoint):
        return value
    if not isinstance(value, str):
        raise ValueError(f"expected an endpoint, got {diagnosis.show(value)}; {_EXAMPLE}")  # noqa: TRY004
    return HostEndpoint.parse(value)


class _Mapping(BaseModel):
    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, arbitrary_types_allowed=True
    )


class HostEntry(_Mapping):
    """One host."""

    endpoint: Annotated[HostEndpoint, BeforeValidator(_endpoint)]
    """Where `nlosim serve` listens there, e.g. `tls/10.0.0.3:7447`."""

    insecure: bool = False
    """Whether an address that is not a loopback one may do without TLS."""


class HostsFile(_Mapping):
    """The shape of a hosts file."""

    credentials: Annotated[str, Field(min_length=1)] | None = None
    """The folder of the credentials, relative to the file."""

    hosts: Annotated[dict[str, HostEntry], Field(min_length=1)]
    """All hosts by name."""


def read_hosts(path: Path) -> Hosts:
    """Read and check a hosts file.

    Raises:
        ScenarioError: all problems, each at its place.
    """
    document = Document.read(path)
    try:
        file = HostsFile.model_validate(document.data)
    except ValidationError as error:
        what = "the hosts file"
        raise ScenarioError(diagnosis.problems(document, HostsFile, error, whole=what)) from None
    problems = [*_names(document, file), *_protections(document, file)]
    if problems:
        raise ScenarioError(sorted(problems, key=lambda p: p.where))
    folder = None if file.credentials is None else (path.parent / file.credentials).absolute()
    endpoints = {name: entry.endpoint for name, entry in file.hosts.items()}
    return Hosts(path=path, folder=folder, endpoints=MappingProxyType(endpoints), document=document)


def _names(document: Document, file: HostsFile) -> list[Problem]:
    problems = []
    for name in file.hosts:
        if re.fullmatch(NAME, name) is None:
            what = f"`{name}` cannot be a name; write letters, digits, `_` and `-` (not first)"
        elif name == RUN:
            what = f"`{RUN}` is the name of the run in the credentials; choose another one"
        elif name == AUTHORITY or name.endswith(KEY):
            what = f"`{name}.pem` is another file of the credentials; choose another name"
        else:
            continue
        problems.append(Problem(document.key(("hosts", name)), f"hosts: {what}"))
    return problems


def _protections(document: Document, file: HostsFile) -> list[Problem]:
    """Endpoints that anybody in the network could use, and those that lack credentials."""
    problems = []
    for name, entry in file.hosts.items():
        address: Address = ("hosts", name, "endpoint")
        endpoint = entry.endpoint
        if endpoint.protocol == "tls" and file.credentials is None:
            what = "TLS takes certificates; name their folder: `credentials: keys`"
        elif endpoint.protocol == "tcp" and not (endpoint.is_loopback or entry.insecure):
            what = (
                f"everybody who reaches {endpoint.address} could take part, for `tcp` is neither "
                "encrypted nor checked; write `tls/` and `credentials`, or `insecure: true`"
            )
        else:
            continue
        problems.append(Problem(document.value(address), f"{diagnosis.spell(address)}: {what}"))
    return problems
