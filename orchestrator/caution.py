"""Values of parameters that bias what is counted in a recording, said where they are declared.

Only the standard library is imported here: native units say it, too, while they are built.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Caution:
    """A value of a parameter with which results mean something else than their name says.

    Attributes:
        value: of the parameter.
        meaning: what it does to whom, for people: the end of "`weak_receptions` is false: ...".
    """

    value: bool | float | str
    meaning: str
