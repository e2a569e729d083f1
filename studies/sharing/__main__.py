"""Makes the page of the study: `python -m studies.sharing PAGE DIR [ANALYSIS]`.

DIR holds what the reports `sharing-study` and `python -m studies.sharing.moments` wrote; pictures
are drawn into it. ANALYSIS is a file of Markdown by hand.
"""

from studies.method.page import command
from studies.sharing.page import draw, page


def main() -> None:
    """Draw, and write the page."""
    command("studies.sharing", page, draw)


if __name__ == "__main__":
    main()
