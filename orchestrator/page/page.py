"""`index.html`: a run to look at, in one file that needs neither a server nor a network."""

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from orchestrator.errors import CosimError, defects, in_words
from orchestrator.findings import METRICS
from orchestrator.page.about import about, title, wiring
from orchestrator.page.curves import curves_of
from orchestrator.page.document import LIBRARY, PAGE, WEB, Document
from orchestrator.page.layer import Content, PageLayer, PageOfRun, installed
from orchestrator.recording.layout import read_json
from orchestrator.recording.reader import Recording
from orchestrator.timebase import Time

logger = logging.getLogger(__name__)

SCRIPTS: Final = tuple(
    WEB / f"{name}.js"
    for name in (
        "inflate", "decode", "dom", "clock", "player", "curves", "chart", "timelines", "layout",
        "wiring", "about", "keys", "page",
    )
)  # fmt: skip
"""The scripts of every page, in the order in which they are run."""


def make_page(directory: Path) -> Path:
    """Write the page of a run into its directory; equal runs make equal bytes.

    Args:
        directory: of a run, finished or not, with its metrics if there are any.

    Returns:
        The file.

    Raises:
        RecordingError: there is no recording.
    """
    path = directory / PAGE
    page_of(directory)[0].write(path)
    return path


def page_of(directory: Path) -> tuple[Document, Time]:
    """The page of a run, and the last time that is on it [ns].

    A layer that cannot show the run is left out, and the page says why.

    Args:
        directory: of a run, finished or not.

    Raises:
        RecordingError: there is no recording.
    """
    recording = Recording(directory)
    manifest = recording.manifest
    start = int(manifest.get("start_ns", 0))
    stop = max(int(manifest.get("reached_ns") or 0), _last(recording, start))
    run = PageOfRun(recording=recording, manifest=manifest, start=start, stop=stop)
    layers: dict[str, Content] = {}
    left_out: dict[str, str] = {}
    used: list[PageLayer] = []
    for name, kind in installed():
        layer = kind()
        try:
            content = layer.content(run)
        except defects() as error:  # a layer is a plug-in and may raise anything
            logger.info("the page is without %s: %r", name, error, exc_info=error)
            said = isinstance(error, CosimError | ValueError)
            left_out[name] = str(error) if said else in_words(error)
            continue
        if content is not None:
            layers[name] = content
            used.append(layer)
    more = [curve for content in layers.values() for curve in content.curves]
    shown = [name for content in layers.values() for name in content.shown]
    data = {
        "start": start / 1e9,
        "span": (stop - start) / 1e9,
        "about": about(manifest),
        "wiring": wiring(manifest),
        "metrics": _metrics(directory),
        "layers": {name: content.data for name, content in layers.items()},
        "left_out": left_out,
        **curves_of(run, more, shown),
    }
    styles = [LIBRARY / "uplot.css", WEB / "page.css"]
    styles += [path for layer in used for path in layer.styles()]
    *first, last = SCRIPTS
    scripts = [path for layer in used for path in layer.scripts()]
    document = Document(
        title=title(manifest),
        data=data,
        arrays=run.arrays,
        styles=styles,
        scripts=[LIBRARY / "uplot.js", *first, *scripts, last],
        licences=[LIBRARY / "uplot.license.txt"],
    )
    return document, stop


def _last(recording: Recording, start: int) -> int:
    """The last time at which something was recorded [ns]; a run that was killed does not say it."""
    if recording.manifest.get("reached_ns"):
        return start
    return max(start, last_time(recording))


def last_time(recording: Recording) -> Time:
    """The last time at which anything was recorded [ns]; 0 if nothing was."""
    ends = [int(recording[name].times[-1]) for name in recording.signals if len(recording[name])]
    return max(ends, default=0)


def _metrics(directory: Path) -> Mapping[str, Any]:
    try:
        return read_json(directory / METRICS)
    except FileNotFoundError:
        return {}
