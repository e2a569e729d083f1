"""Makes the page of the study: `python -m studies.lasting PAGE DIR [ANALYSIS]`.

DIR holds what the reports `lasting-study` of the experiments wrote; tables and figures of all of
them together are written there, too. ANALYSIS is a file of Markdown by hand.
"""

from studies.lasting.page import page
from studies.lasting.report import write_study
from studies.method.page import command


def main() -> None:
    """Write tables, figures and the page."""
    command("studies.lasting", page, prepare=write_study)


if __name__ == "__main__":
    main()
