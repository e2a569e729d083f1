"""Makes the page of the study: `python -m studies.generalisation PAGE DIR [ANALYSIS]`.

DIR holds what the reports `generalisation` of the experiments wrote; the table of all of them is
written there, too. ANALYSIS is a file of Markdown by hand.
"""

from studies.generalisation.page import page
from studies.generalisation.report import write_campaign
from studies.method.page import command


def main() -> None:
    """Write the table and the page."""
    command("studies.generalisation", page, prepare=write_campaign)


if __name__ == "__main__":
    main()
