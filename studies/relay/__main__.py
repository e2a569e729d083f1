"""Makes the page of the relay study: `python -m studies.relay PAGE DIR [ANALYSIS]`.

DIR holds what the report `relay-study` wrote; ANALYSIS is a file of Markdown by hand.
"""

from studies.method.page import command
from studies.relay.page import page


def main() -> None:
    """Write the page."""
    command("studies.relay", page)


if __name__ == "__main__":
    main()
