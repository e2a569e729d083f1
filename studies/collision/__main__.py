"""Makes the page of the campaign: `python -m studies.collision PAGE DIR [ANALYSIS]`.

DIR holds what the reports `collision-study` of the experiments wrote; tables and figures of all of
them together are written there, too. ANALYSIS is a file of Markdown by hand.
"""

import argparse
import os
from pathlib import Path

from studies.collision import results
from studies.collision.campaign import Campaign
from studies.collision.page import page


def main() -> None:
    """Write tables, figures and the page."""
    parser = argparse.ArgumentParser(prog="python -m studies.collision")
    parser.add_argument("page", type=Path, help="to write (Markdown)")
    parser.add_argument("directory", type=Path, help="what the reports wrote")
    parser.add_argument(
        "analysis", type=Path, nargs="?", help="text by hand, included if it is there"
    )
    given = parser.parse_args()
    link = Path(os.path.relpath(given.directory, given.page.parent)).as_posix()
    try:
        results.write(Campaign.read(given.directory), given.directory)
        text = page(given.directory, link, given.analysis)
    except FileNotFoundError as error:
        parser.error(f"there is no `{error.filename}`; `make paper` writes it")
    except ValueError as error:
        parser.error(str(error))
    given.page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
