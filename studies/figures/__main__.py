"""Draws the figures of the manual again: `python -m studies.figures [DOCS] [--only NAME ...]`."""

import argparse
from pathlib import Path

from orchestrator.suggestion import suggestion
from studies.figures.catalogue import catalogue, folder_of


def main() -> None:
    """Draw all figures, or some."""
    parser = argparse.ArgumentParser(
        prog="python -m studies.figures",
        description="Draw the figures of the manual again, from the tables beside them.",
    )
    parser.add_argument(
        "docs", type=Path, nargs="?", default=Path("docs"), help="the manual (default: docs)"
    )
    parser.add_argument("--only", nargs="+", metavar="NAME", help="e.g. results/figure8")
    given = parser.parse_args()
    known = catalogue(given.docs)
    for name in given.only or known:
        if name not in known:
            parser.error(f"there is no figure `{name}`; {suggestion(name, known)}")
    for name in given.only or known:
        try:
            known[name](folder_of(given.docs, name))
        except FileNotFoundError as error:
            parser.error(f"{name}: there is no `{error.filename}`")
        except ValueError as error:
            parser.error(f"{name}: {error}")
        print(name)  # noqa: T201 - a command


if __name__ == "__main__":
    main()
