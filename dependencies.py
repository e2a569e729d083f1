"""Makes docs/dependencies.md: `make dependencies`, which needs an environment with all extras.

What an installation consists of: each package with its version, licence and size on disk, for the
base installation and for what extras add. Sizes are those of the files of a package as pip installs
them, without the bytecode that Python makes later.
"""

import argparse
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from typing import Final

OURS: Final = "nlosim"
BEGIN: Final = "<!-- made by `make dependencies` -->\n"
END: Final = "<!-- end -->\n"
_TOOLS: Final = ("dev", "docs", "release", "audit", "mutation")
"""Extras for work on this package."""

_LONGEST: Final = 60
"""Characters of the name of a licence."""

_CLASSIFIER: Final = "License :: OSI Approved :: "


@dataclass(frozen=True, slots=True, kw_only=True)
class Package:
    """An installed package.

    Attributes:
        name: in its normal form.
        version: installed.
        licence: as its metadata say.
        size: of its files [byte].
    """

    name: str
    version: str
    licence: str
    size: int


def normal(name: str) -> str:
    """The normal form of the name of a package."""
    return re.sub(r"[-_.]+", "-", name).lower()


def licence(found: Distribution) -> str:
    """The licence of a package, as an expression if it has one."""
    said = found.metadata
    classified = [
        text.removeprefix(_CLASSIFIER)
        for text in said.get_all("Classifier") or []
        if text.startswith(_CLASSIFIER)
    ]
    expression, short = (
        (said.get_all(key) or [""])[0] for key in ("License-Expression", "License")
    )
    if len(short) > _LONGEST or "\n" in short:  # the whole text of it
        short = ""
    return expression or " AND ".join(classified) or short.strip() or "not said"


def package(found: Distribution) -> Package:
    """What is known of an installed package."""
    paths = (
        Path(str(file.locate())) for file in found.files or [] if "__pycache__" not in str(file)
    )
    return Package(
        name=normal(found.metadata["Name"]),
        version=found.version,
        licence=licence(found),
        size=sum(path.stat().st_size for path in paths if path.is_file()),
    )


def required(extra: str = "") -> dict[str, Package]:
    """What is installed of what this package requires, and of what that requires, by name.

    Args:
        extra: whose requirements are asked for; empty: the base ones.
    """
    found: dict[str, Package] = {}
    waiting = list(_requirements(OURS, extra))
    while waiting:
        name = waiting.pop()
        if name in found or name == OURS:
            continue
        try:
            found[name] = package(distribution(name))
        except PackageNotFoundError:  # for another platform
            continue
        waiting += _requirements(name, "")
    return dict(sorted(found.items()))


def _requirements(name: str, extra: str) -> Iterator[str]:
    for text in distribution(name).requires or []:
        extras = re.findall(r"extra\s*==\s*['\"]([\w-]+)['\"]", text)
        if extras != ([extra] if extra else []):
            continue
        match = re.match(r"([A-Za-z0-9._-]+)(?:\[([\w,-]+)\])?", text)
        if match is None:
            continue
        if normal(match[1]) == OURS:  # an extra that is made of others
            for other in (match[2] or "").split(","):
                yield from _requirements(OURS, other)
        else:
            yield normal(match[1])


def _is_installed(name: str) -> bool:
    try:
        distribution(name)
    except PackageNotFoundError:
        return False
    return True


def megabytes(size: int) -> str:
    """A size for people."""
    return f"{size / 1e6:.1f}"


def base_table(packages: Iterable[Package]) -> Iterator[str]:
    """The base installation, the heaviest first."""
    chosen = sorted(packages, key=lambda each: (-each.size, each.name))
    yield "| package | version | licence | MB |"
    yield "|---|---|---|---|"
    for each in chosen:
        yield f"| {each.name} | {each.version} | {each.licence} | {megabytes(each.size)} |"
    yield f"| together | | | {megabytes(sum(each.size for each in chosen))} |"


def extras_table(base: Iterable[str], former: str = "") -> Iterator[str]:
    """What each extra adds to the base installation.

    Args:
        base: packages of the base installation, by name.
        former: the page as it was, whose row of an extra stays if nothing of it is installed here.
    """
    known = set(base)
    said = distribution(OURS).metadata.get_all("Provides-Extra") or []
    yield "| extra | adds | MB |"
    yield "|---|---|---|"
    for extra in (each for each in said if each not in _TOOLS):
        row = re.search(rf"^\| `{extra}` \|.*$", former, re.MULTILINE)
        if row is not None and not any(map(_is_installed, _requirements(OURS, extra))):
            yield row[0]
            continue
        more = [each for name, each in required(extra).items() if name not in known]
        told = "; ".join(f"{each.name} {each.version} ({each.licence})" for each in more)
        yield f"| `{extra}` | {told} | {megabytes(sum(each.size for each in more))} |"


def page(text: str) -> str:
    """The page with its tables made again.

    Raises:
        ValueError: there is no place for them.
    """
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError(f"the page has no `{BEGIN.strip()}` with `{END.strip()}` behind it")
    base = required()
    python = ".".join(map(str, sys.version_info[:2]))
    tables = [
        f"The base installation, on {sys.platform} with Python {python}:",
        "",
        *base_table(base.values()),
        "",
        "What extras add to it:",
        "",
        *extras_table(base, rest),
    ]
    return "".join([before, begin, "\n", *(f"{line}\n" for line in tables), "\n", end, after])


def main(arguments: Sequence[str] | None = None) -> int:
    """The command line; returns the exit code."""
    parser = argparse.ArgumentParser(prog="dependencies.py", description=__doc__)
    parser.add_argument("page", type=Path, help="to be made again")
    path: Path = parser.parse_args(arguments).page
    try:
        path.write_text(page(path.read_text(encoding="utf-8")), encoding="utf-8")
    except (OSError, ValueError) as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
