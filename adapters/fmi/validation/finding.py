"""What is wrong with an FMU, where, and which rule says so."""

from dataclasses import dataclass

from typing_extensions import override

from adapters.fmi.validation.document import Place


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One broken rule, or a remark.

    Attributes:
        file: the FMU, or a file in it, `car.fmu/modelDescription.xml`.
        place: in that file; `None` for the file as a whole.
        what: a sentence.
        rule: where the standard says it: `FMI 3.0.2, 2.4.7`.
        is_remark: nothing is wrong, but it may not be meant.
    """

    file: str
    place: Place | None
    what: str
    rule: str
    is_remark: bool = False

    @override
    def __str__(self) -> str:
        where = "" if self.place is None else f":{self.place.line}:{self.place.column}"
        last = "a remark" if self.is_remark else self.rule
        return f"{self.file}{where}: {self.what} ({last})"
