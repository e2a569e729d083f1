"""The XML schemas of the standards, which FMPy carries."""

import functools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import fmpy
from lxml import etree

from adapters.fmi.validation.document import Element, Place
from adapters.fmi.validation.finding import Finding

FILES: Final = {
    (2, "modelDescription.xml"): "fmi2/fmi2ModelDescription.xsd",
    (3, "modelDescription.xml"): "fmi3/fmi3ModelDescription.xsd",
    (3, "buildDescription.xml"): "fmi3/fmi3BuildDescription.xsd",
    (3, "terminalsAndIcons.xml"): "fmi3/fmi3TerminalsAndIcons.xsd",
}
_STEP: Final = re.compile(r"([^\[\]]+)(?:\[(\d+)\])?")
_SUBJECT: Final = re.compile(r"Element '([^']*)'(?:, attribute '([^']*)')?: (?:\[[^\]]*\] )?(.*)")


def schema_findings(
    xml: bytes, root: Element, file: str, *, version: int, rule: str
) -> Iterator[Finding]:
    """Everything in a file that its schema does not allow.

    Args:
        xml: the contents.
        root: the same, read.
        file: what findings call it; its last part says which schema it has.
        version: 2 or 3.
        rule: where the standard speaks of the file.
    """
    schema = _schema(version, file.rpartition("/")[2])
    if schema is None:
        return
    try:
        schema.validate(etree.fromstring(xml, _parser()))
    except etree.LxmlError as why:  # it has entities, or is what expat takes and libxml2 does not
        what = f"cannot be compared with its schema: {why}"
        yield Finding(file=file, place=root.place, what=what, rule=rule)
        return
    seen = set()
    for error in schema.error_log:
        element = _at(root, error.path or "")
        attribute, what = _said(error.message)
        place = Place(error.line, 1) if element is None else element.where(attribute)
        if (place, attribute) not in seen:  # a wrong value is told twice: as facet, as type
            seen.add((place, attribute))
            yield Finding(file=file, place=place, what=what, rule=rule)


@functools.cache
def _schema(version: int, name: str) -> Any:
    path = FILES.get((version, name))
    if path is None:
        return None
    return etree.XMLSchema(file=str(Path(fmpy.__file__).parent / "schema" / path))


def _parser() -> Any:
    return etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=True)


def _at(root: Element, path: str) -> Element | None:
    """The element at a path such as `/fmiModelDescription/ModelVariables/Float64[2]`."""
    found: Element | None = None
    for step in filter(None, path.split("/")):
        match = _STEP.fullmatch(step)
        if match is None:
            return None
        same = [root] if found is None else list(found.all(match[1]))
        index = int(match[2] or 1) - 1
        if index >= len(same):
            return None
        found = same[index]
    return found


def _said(message: str) -> tuple[str | None, str]:
    """The attribute of which a message speaks, if it does, and the message in our form."""
    match = _SUBJECT.fullmatch(message)
    if match is None:
        return None, message
    element, attribute, what = match.groups()
    what = what.rstrip(".").replace("'", "`")
    subject = f"`{element}`" if attribute is None else f"`{attribute}` of `{element}`"
    return attribute, f"{subject}: {what[:1].lower()}{what[1:]}"
