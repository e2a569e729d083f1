"""Makes the page of the relay study: `python -m studies.relay PAGE DIR [ANALYSIS]`.

DIR holds what the report `relay-study` wrote; ANALYSIS is a file of Markdown by hand.
"""

import argparse
import os
from pathlib import Path

from studies.relay.page import page


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(prog="python -m studies.relay")
    parser.add_argument("page", type=Path, help="to write (Markdown)")
    parser.add_argument("directory", type=Path, help="what the report wrote")
    parser.add_argument(
        "analysis", type=Path, nargs="?", help="text by hand, included if it is there"
    )
    given = parser.parse_args()
    link = Path(os.path.relpath(given.directory, given.page.parent)).as_posix()
    try:
        text = page(given.directory, link, given.analysis)
    except FileNotFoundError as error:
        parser.error(f"there is no `{error.filename}`; `make paper` writes it")
    given.page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
