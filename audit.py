"""Looks for known vulnerabilities in what is installed: `make audit`.

`pip-audit` asks the vulnerability service of the package index. A service that cannot be reached,
or that knows nothing, must not look like a clean result: first it is asked about a package that is
known to have one. Exit codes: 0, nothing is known; 1, each vulnerability is named; 2, nothing was
checked, and why.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

CANARY: Final = "pyyaml==5.3"
"""It runs code that a document names (CVE-2020-14343); fixed in 5.4."""

Ask: TypeAlias = Callable[[Sequence[str]], subprocess.CompletedProcess[str]]
"""Calls `pip-audit` with arguments."""


class NothingCheckedError(Exception):
    """Why nothing was checked, in a sentence."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Audited:
    """What the service said.

    Attributes:
        checked: how many packages it knows.
        vulnerable: each vulnerability, as a sentence.
        skipped: each package that it does not know, as a sentence.
    """

    checked: int
    vulnerable: tuple[str, ...]
    skipped: tuple[str, ...]


def pip_audit(arguments: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Call `pip-audit` of this environment."""
    command = (sys.executable, "-m", "pip_audit", "--progress-spinner", "off", *arguments)
    return subprocess.run(command, capture_output=True, text=True, check=False)


def asked(ask: Ask, *arguments: str) -> Audited:
    """What the service says.

    Raises:
        NothingCheckedError: it says nothing.
    """
    done = ask(["--format", "json", *arguments])
    try:
        found = json.loads(done.stdout)["dependencies"]
    except (ValueError, KeyError, TypeError):
        lines = (done.stderr or done.stdout).strip().splitlines() or ["it says nothing"]
        raise NothingCheckedError(f"pip-audit fails: {lines[-1].strip()}") from None
    known = [each for each in found if "vulns" in each]
    return Audited(
        checked=len(known),
        vulnerable=tuple(said for each in known for said in _vulnerable(each)),
        skipped=tuple(f"{e['name']}: {e['skip_reason']}" for e in found if "skip_reason" in e),
    )


def _vulnerable(package: Mapping[str, Any]) -> Iterator[str]:
    for each in package["vulns"]:
        names = ", ".join([each["id"], *each.get("aliases", ())])
        fixed = ", ".join(each.get("fix_versions", ())) or "no version"
        yield f"{package['name']} {package['version']}: {names}; fixed in {fixed}"


def audit(folder: Path, ask: Ask = pip_audit) -> Audited:
    """What is known of the packages in `folder`.

    Args:
        folder: `site-packages` of an environment.
        ask: who knows.

    Raises:
        NothingCheckedError: nobody could be asked, or who was asked knows nothing.
    """
    if not any(folder.glob("*.dist-info")):
        raise NothingCheckedError(f"`{folder}` holds no packages")
    with tempfile.TemporaryDirectory(prefix="nlosim-audit-") as name:
        wanted = Path(name) / "requirements.txt"
        wanted.write_text(f"{CANARY}\n", encoding="utf-8")
        canary = asked(ask, "--no-deps", "--disable-pip", "--requirement", str(wanted))
    if not canary.vulnerable:
        raise NothingCheckedError(
            f"the service answers, but knows of no vulnerability of {CANARY}, which has one; is "
            "this machine behind a mirror without that service?"
        )
    found = asked(ask, "--path", str(folder))
    if not found.checked:
        raise NothingCheckedError(f"the service knows none of the packages in `{folder}`")
    return found


def main(arguments: Sequence[str] | None = None, ask: Ask = pip_audit) -> int:
    """The command line; returns the exit code."""
    parser = argparse.ArgumentParser(prog="audit.py", description=__doc__)
    parser.add_argument("folder", type=Path, help="site-packages of the environment to look at")
    folder: Path = parser.parse_args(arguments).folder
    try:
        found = audit(folder, ask)
    except NothingCheckedError as error:
        sys.stderr.write(f"error: nothing was checked: {error}\n")
        return 2
    for line in (*found.vulnerable, *(f"not checked: {each}" for each in found.skipped)):
        sys.stdout.write(f"{line}\n")
    sys.stdout.write(f"{found.checked} packages, {len(found.vulnerable)} known vulnerabilities\n")
    return 1 if found.vulnerable else 0


if __name__ == "__main__":
    sys.exit(main())
