"""The colours of all figures, and what link classes look like."""

from typing import Final

BLUE: Final = "#0072B2"
VERMILLION: Final = "#D55E00"
GREEN: Final = "#009E73"
PURPLE: Final = "#CC79A7"
ORANGE: Final = "#E69F00"
SKY: Final = "#56B4E9"
BLACK: Final = "#000000"
COLOURS: Final = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)
"""Okabe and Ito's palette, which readers with colour blindness can tell apart."""

DARK: Final = "#666666"
GREY: Final = "#7F7F7F"
PALE: Final = "#BBBBBB"
LIGHT: Final = "#D9D9D9"
BROWN: Final = "#8A6D3B"
MINT: Final = "#7FCEB9"
GROUND: Final = "#A89F91"
"""What is around: those of whom nothing is said, roads, buildings."""

LINK_COLOURS: Final = {"all": BLACK, "LOS": GREEN, "NLOSv": ORANGE, "NLOSb": VERMILLION}
"""The colour of each link class."""

LINK_LINES: Final = {"all": "-.", "LOS": "-", "NLOSv": "--", "NLOSb": ":"}
LINK_MARKERS: Final = {"all": "s", "LOS": "o", "NLOSv": "^", "NLOSb": "v"}
"""The line and the mark of each link class, for readers without colours."""
