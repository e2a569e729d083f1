"""What inputs say about nothing driving them, in annotations of modelDescription.xml.

FMI has no word for it; annotations are its way to say more, and who does not know one ignores it
(FMI 3.0.2, section 2.4.7). `fmus.native` writes it for our units, and anybody may.
"""

from typing import Final
from xml.etree import ElementTree as ET

from orchestrator.absence import Need, Undriven

_WHERE: Final = "Annotations/Annotation[@type='io.github.nlosim.undriven']/Undriven"
_NEEDS: Final = {need.value: need for need in Need}


def annotated(root: ET.Element) -> dict[str, Undriven]:
    """What the inputs of an FMU say, by name; what cannot be understood is ignored.

    Args:
        root: of modelDescription.xml; in FMI 2.0 no variable says anything.
    """
    return {
        variable.get("name", ""): Undriven(
            (said.text or "").strip(),
            _NEEDS[said.get("need", "")],
            frozenset(said.get("beside", "").split()),
        )
        for variable in root.iterfind("ModelVariables/*")
        for said in variable.iterfind(_WHERE)
        if said.get("need") in _NEEDS and variable.get("causality") == "input"
    }
