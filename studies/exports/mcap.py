"""A run as an MCAP file, which Foxglove and Lichtblick open."""

from pathlib import Path
from typing import Final

from studies.exports.export import Asked, Exported, Format, described, module_for
from studies.exports.show import Show, Stage

_SUBJECT: Final = "--mcap"
_WINDOW: Final = 1_000_000_000
"""What is read and sorted at once [ns]."""


def write(asked: Asked, draft: Path) -> Exported:
    """Write one file.

    Args:
        asked: of which run.
        draft: the file, which is created.
    """
    stage = Stage(_SUBJECT)
    show = Show(asked.recording, asked.directory)
    count = 0
    with stage.sdk.open_mcap(str(draft), context=stage.context) as writer:
        writer.write_metadata("nlosim", described(asked))
        show.set_up(stage, show.begin)
        for until in range(show.begin, show.end + _WINDOW, _WINDOW):
            count += show.between(stage, until - _WINDOW, min(until, show.end))
    span = f"from {show.begin / 1e9:g} s to {show.end / 1e9:g} s"
    return Exported(
        files={f"{asked.name}.mcap": f"{count} samples {span}"},
        left_out=(*show.left_out, *show.lost.said),
    )


def _check() -> None:
    module_for("foxglove", _SUBJECT, "mcap")


FORMATS: Final = {"mcap": Format(".mcap", write, _check)}
