"""What parameters say about values that bias results, in annotations of modelDescription.xml.

FMI has no word for it; see `adapters.fmi.undriven`.
"""

from typing import Final
from xml.etree import ElementTree as ET

from orchestrator.caution import Caution

_WHERE: Final = "Annotations/Annotation[@type='io.github.nlosim.caution']/Caution"
_TRUTHS: Final = {"true": True, "1": True, "false": False, "0": False}


def cautions(root: ET.Element) -> dict[str, Caution]:
    """What the parameters of an FMU say, by name; what cannot be understood is ignored.

    Args:
        root: of modelDescription.xml; in FMI 2.0 no variable says anything.
    """
    found = {}
    for variable in root.iterfind("ModelVariables/*"):
        for said in variable.iterfind(_WHERE):
            value = _value(variable.tag, said.get("value", ""))
            if value is not None:
                found[variable.get("name", "")] = Caution(value, (said.text or "").strip())
    return found


def _value(kind: str, text: str) -> bool | float | str | None:
    if kind == "Boolean":
        return _TRUTHS.get(text)
    if kind in {"String", "Enumeration"}:
        return text
    try:
        return float(text)
    except ValueError:
        return None
