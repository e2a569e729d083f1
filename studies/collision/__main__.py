"""Makes the page of the campaign: `python -m studies.collision PAGE DIR [ANALYSIS]`.

DIR holds what the reports `collision-study` of the experiments wrote; tables and figures of all of
them together are written there, too. ANALYSIS is a file of Markdown by hand.
"""

from studies.collision.page import page
from studies.collision.report import write_campaign
from studies.method.page import command


def main() -> None:
    """Write tables, figures and the page."""
    command("studies.collision", page, prepare=write_campaign)


if __name__ == "__main__":
    main()
