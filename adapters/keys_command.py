"""`nlosim keys`, found by the entry point group `orchestrator.commands`.

What it takes is loaded when it is called.
"""

import argparse
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from orchestrator.cli.command import command
from orchestrator.cli.outcome import Outcome
from orchestrator.errors import CosimError

if TYPE_CHECKING:
    from adapters.keys import Made

_DAYS: Final = 365
_LONGEST_DAYS: Final = 3650

_SOON: Final = 30
"""A certificate that ends so soon is worth a word [d]."""

_DETAILS: Final = """\
HOSTS_FILE names the machines that take part in runs, and a folder:

  credentials: keys
  hosts:
    gpu: {endpoint: tls/10.0.0.3:7447}

Into that folder come, as far as they are not there yet:

  authority.pem, authority-key.pem   who signs; the key stays here, nobody else needs it
  run.pem, run-key.pem               for whoever starts runs
  gpu.pem, gpu-key.pem               for the machine of that name, valid for its address only

Give each machine `authority.pem` and its own two files, and no other. Nothing that is there is
overwritten: after a machine was added to the file, the same command makes what is missing. To make
something again (it expired, the address changed, a key got lost), move its two files away. Whoever
has a stolen key takes part until it expires; to shut him out sooner, move the whole folder away,
make all of it again, and hand it out.

  nlosim keys hosts.yaml
  nlosim keys hosts.yaml --days 30
"""


class MissingCryptographyError(CosimError):
    """The package `cryptography` is not installed. Exit code 2."""


def add_command(commands: Any) -> None:
    """Add `keys` to the subparsers of the command line."""
    summary = "certificates for runs across hosts"
    what = "Makes a small authority, and a certificate for each host of a file and for runs."
    parser = command(commands, "keys", summary, _DETAILS, description=what, execute=_execute)
    parser.add_argument("hosts_file", type=Path, metavar="HOSTS_FILE", help="a hosts file, YAML")
    parser.add_argument(
        "--days",
        type=_days,
        default=_DAYS,
        metavar="N",
        help="how long new certificates are valid (default: %(default)s)",
    )


def _days(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= _LONGEST_DAYS:
        raise argparse.ArgumentTypeError(f"expected 1 to {_LONGEST_DAYS} days, got `{text}`")
    return int(text)


def _execute(arguments: argparse.Namespace) -> Outcome:
    try:
        from adapters.keys import make_credentials  # noqa: PLC0415 - an extra, and the help is ours
    except ModuleNotFoundError as error:
        what = "certificates take `cryptography`, which is not installed"
        raise MissingCryptographyError(f"{what}: pip install 'nlosim[keys]'") from error
    from orchestrator.hosts_file import read_hosts  # noqa: PLC0415

    now = datetime.now(UTC).replace(microsecond=0)
    made = make_credentials(read_hosts(arguments.hosts_file), now, arguments.days)
    data = {
        "folder": str(made[0].files[0].parent),
        "credentials": [
            {
                "name": each.name,
                "is_new": each.is_new,
                "valid_until": each.until.isoformat(),
                "certificate": each.files[0].name,
                "key": each.files[1].name,
            }
            for each in made
        ],
    }
    return Outcome(data=data, text=_text(made, now))


def _text(made: "list[Made]", now: datetime) -> str:
    width = max(len(each.name) for each in made)
    lines = [f"{made[0].files[0].parent}:"]
    for each in made:
        left = (each.until - now).days
        soon = f", in {left} days" if left < _SOON else ""
        state = "made" if each.is_new else "kept"
        lines.append(f"  {each.name:{width}}  {state}, valid until {each.until:%Y-%m-%d}{soon}")
    if any(each.is_new for each in made[2:]):
        lines.append("give each machine `authority.pem`, and NAME.pem and NAME-key.pem of its own")
    return "\n".join(lines)
