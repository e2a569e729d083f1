"""All rules about one FMU."""

import re
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import fmpy

from adapters.fmi.archive import UNREADABLE, archive_problems
from adapters.fmi.exports import ExportsError
from adapters.fmi.unpacked import host_folder
from adapters.fmi.validation import definitions, names, structure, variables
from adapters.fmi.validation.binaries import made_for, misplaced, shown
from adapters.fmi.validation.document import MarkupError, parse
from adapters.fmi.validation.finding import Finding
from adapters.fmi.validation.functions import missing
from adapters.fmi.validation.model import SECTIONS, Model
from adapters.fmi.validation.schema import FILES, schema_findings

_DESCRIPTION: Final = "modelDescription.xml"
_ANY: Final = "FMI 2.0.4, 2.3; FMI 3.0.2, 2.5"
_VERSION: Final = re.compile(r"(2)\.0(?:\.\d+)?|(3)\.\d+(?:\.\d+)?(?:[-.].+)?")
_FOLDERS: Final = {"sources", "terminalsAndIcons"}
"""Where the further files in XML are that have a schema."""

_LIBRARIES: Final = {"so", "dll", "dylib"}
"""How shared libraries end."""


def validate(path: Path) -> list[Finding]:
    """Every rule of FMI 2.0.4 or 3.0.2 that an FMU breaks, in the order of its files and lines.

    The XML is held against the schemas of the standard and the rules of its text; of every binary
    it is seen whether it exports the functions of the standard. Nothing of the FMU is run.

    Args:
        path: of the archive.

    Returns:
        Nothing if the FMU is as it should be; remarks are among them.

    Raises:
        OSError: the file cannot be read.
    """
    name = path.name
    try:
        with zipfile.ZipFile(path) as archive:
            return sorted(
                _findings(archive, name), key=lambda f: (f.file, f.place is not None, f.place)
            )
    except UNREADABLE as error:
        if isinstance(error, OSError) and error.errno is not None:
            raise  # of the file itself
        what = f"is no ZIP archive, or damaged: {error}"
        return [Finding(file=name, place=None, what=what, rule=_ANY)]


def _findings(archive: zipfile.ZipFile, name: str) -> Iterator[Finding]:
    problems = archive_problems(archive)
    for what in problems:
        yield Finding(file=name, place=None, what=what, rule=_ANY)
    if problems:
        return  # what it holds is not to be unpacked
    if _DESCRIPTION not in archive.namelist():
        what = f"has no `{_DESCRIPTION}` at the top of the archive"
        yield Finding(file=name, place=None, what=what, rule=_ANY)
        return
    file = f"{name}/{_DESCRIPTION}"
    xml = archive.read(_DESCRIPTION)
    try:
        root = parse(xml)
    except MarkupError as error:
        yield Finding(file=file, place=error.place, what=f"is no XML: {error}", rule=_ANY)
        return
    match = _VERSION.fullmatch(root.get("fmiVersion") or "")
    if root.tag != "fmiModelDescription" or match is None:
        said = root.get("fmiVersion")
        what = f"`fmiVersion` is {said!r}: neither FMI 2.0 nor 3.0" if said else "has no fmiVersion"
        yield Finding(file=file, place=root.where("fmiVersion"), what=what, rule=_ANY)
        return
    model = Model(file, root, int(match[1] or match[2]))
    yield from schema_findings(xml, root, file, version=model.version, rule=model.rule("root"))
    for rules in (names, variables, definitions, structure):
        yield from rules.findings(model)
    yield from _instance(model)
    yield from _binaries(archive, name, model)
    for version, other in FILES:
        if version == model.version and other != _DESCRIPTION:
            yield from _other_file(archive, name, other, model)


def _instance(model: Model) -> Iterator[Finding]:
    attribute = "guid" if model.version == 2 else "instantiationToken"
    if model.root.get(attribute) == "":
        yield model.finding(model.root, f"`{attribute}` is empty", "root", attribute)
    if not model.kinds:
        what = "is for nothing: there is neither ModelExchange nor CoSimulation"
        yield model.finding(model.root, what, "root")


def _binaries(archive: zipfile.ZipFile, name: str, model: Model) -> Iterator[Finding]:
    entries = archive.namelist()
    index = SECTIONS["archive"][model.version - 2]
    rule = f"FMI {('2.0.4', '3.0.2')[model.version - 2]}, {index}"
    has_sources = any(e.startswith("sources/") for e in entries)
    folder, suffix = host_folder(model.version), fmpy.sharedLibraryExtension
    for identifier in dict.fromkeys(k.get("modelIdentifier") or "" for k in model.kinds):
        kinds = [k.tag for k in model.kinds if k.get("modelIdentifier") == identifier]
        binary = re.compile(rf"binaries/[^/]+/{re.escape(identifier)}\.(\w+)")
        found = {entry: match[1] for entry in entries if (match := binary.fullmatch(entry))}
        if not has_sources and not found:
            what = f"has neither a binary `{identifier}` nor sources"
            yield Finding(file=name, place=None, what=what, rule=rule)
        wrong = dict(misplaced(archive, identifier, model.version))
        for entry, what in wrong.items():
            yield Finding(file=f"{name}/{entry}", place=None, what=what, rule=rule)
        platform = fmpy.platform_tuple
        wanted = f"binaries/{folder}/{identifier}{suffix}"
        if wanted not in entries:
            what = f"cannot run on this machine: `{wanted}` is missing"
            yield Finding(file=name, place=None, what=what, rule=rule, is_remark=True)
        elif (made := made_for(archive, wanted)) is None or not made.runs_on(platform):
            what = f"cannot run on this machine: `{wanted}` is {shown(made)}"
            yield Finding(file=name, place=None, what=what, rule=rule, is_remark=True)
        for entry, ending in found.items():
            is_looked_into = ending in _LIBRARIES and entry not in wrong
            if is_looked_into and (what := _exports(archive.read(entry), model, kinds)):
                functions = SECTIONS["functions"][model.version - 2]
                rule_ = f"FMI {('2.0.4', '3.0.2')[model.version - 2]}, {functions}"
                yield Finding(file=f"{name}/{entry}", place=None, what=what, rule=rule_)


def _exports(binary: bytes, model: Model, kinds: Sequence[str]) -> str:
    """What is wrong with the functions that a library exports; empty if nothing is."""
    try:
        absent = missing(binary, model.version, kinds)
    except ExportsError as error:
        return f"cannot be told what it exports: {error}"
    return f"does not export {', '.join(f'`{f}`' for f in absent)}" if absent else ""


def _other_file(archive: zipfile.ZipFile, name: str, other: str, model: Model) -> Iterator[Finding]:
    """A further file in XML, if it is there."""
    for entry in archive.namelist():
        if entry.rpartition("/")[2] != other or entry.split("/")[0] not in _FOLDERS:
            continue
        file, xml = f"{name}/{entry}", archive.read(entry)
        about = "sources" if other.startswith("build") else "terminals"
        try:
            root = parse(xml)
        except MarkupError as error:
            what = f"is no XML: {error}"
            yield Finding(file=file, place=error.place, what=what, rule=model.rule(about))
            continue
        yield from schema_findings(xml, root, file, version=model.version, rule=model.rule(about))
