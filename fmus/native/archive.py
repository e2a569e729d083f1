"""The FMU archive: the same bytes for the same contents."""

import html
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Final
from xml.etree import ElementTree as ET

from fmus.native.interface import Interface, Variable

_DATE: Final = (1980, 1, 1, 0, 0, 0)  # the earliest a ZIP archive can hold


def write_archive(path: Path, files: Mapping[str, bytes], *, comment: str) -> None:
    """Write `files` (by name in the archive) to `path`, in one step.

    Args:
        path: where the FMU goes; its folder exists.
        files: contents by name; written in the order of their names, the description first.
        comment: the archive's comment, for `read_comment`.
    """
    temporary = path.with_name(f"{path.name}.{os.getpid()}.part")  # two builds may race
    order = sorted(files, key=lambda name: (name != "modelDescription.xml", name))
    with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in order:
            entry = zipfile.ZipInfo(name, _DATE)
            entry.create_system = 3  # Unix, on every host
            entry.external_attr = 0o644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, files[name])
        archive.comment = comment.encode()
    temporary.replace(path)


def read_comment(path: Path) -> str | None:
    """The comment of the archive at `path`; `None` if there is no such archive."""
    try:
        with zipfile.ZipFile(path) as archive:
            return archive.comment.decode(errors="replace")
    except (OSError, zipfile.BadZipFile):
        return None


def build_description(interface: Interface, sources: list[str]) -> bytes:
    """The bytes of sources/buildDescription.xml (FMI 3.0.2, section 2.5.1.3).

    Args:
        interface: of the unit.
        sources: names of the C files to be compiled.
    """
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=interface.name)
    files = ET.SubElement(configuration, "SourceFileSet", language="C11")
    for name in sources:
        ET.SubElement(files, "SourceFile", name=name)
    ET.indent(root)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root) + b"\n"


def documentation(interface: Interface) -> bytes:
    """The bytes of documentation/index.html: the table of variables for people."""
    rows = "\n".join(map(_row, interface.variables))
    title = html.escape(interface.name)
    text = f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>{title}</title>
<style>
body {{ font-family: sans-serif; margin: 2em; }}
table {{ border-collapse: collapse; }}
th, td {{ border: 1px solid #aaa; padding: 0.3em 0.6em; text-align: left; }}
</style>
</head>
<body>
<h1>{title}</h1>
<p>{html.escape(interface.description)}</p>
<p>FMI 3.0 Co-Simulation. Arrays that name a structural parameter as an axis are resized in
(Re)Configuration Mode; set all inputs along that axis again afterwards.</p>
<table>
<tr><th>name</th><th>causality</th><th>type</th><th>unit</th><th>start</th><th>meaning</th></tr>
{rows}
</table>
</body>
</html>
"""
    return text.encode()


def _row(variable: Variable) -> str:
    axes = ", ".join(map(str, variable.dimensions))
    kind = f"{variable.type}[{axes}]" if axes else variable.type
    if variable.items:
        kind += f": {variable.listed_items()}"
    start = "" if variable.causality == "output" or variable.type == "Binary" else variable.start
    unit = variable.mime_type if variable.type == "Binary" else variable.unit
    cells = (variable.name, variable.causality, kind, unit, f"{start}", variable.description)
    return "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>"
