"""Where in a component's own code an exception came from."""

import sys
import traceback
from pathlib import Path
from typing import Final

_HERE: Final = Path(__file__).resolve().parent
_INSTALLED: Final = "site-packages"


def raised_at(error: BaseException, owner: type | None = None) -> str:
    """The innermost line of the component that led to `error`, `FILE:LINE, in FUNCTION`.

    A component's own code is what lies in the folder of the first function of it that was called,
    or beneath; what it calls of other packages is not. Empty if `error` never was there.

    Args:
        error: that was raised.
        owner: the class of the component. It may derive from one of another package, whose methods
            are called first: its own code then is that of its own folder, if it was there.
    """
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if _HERE not in Path(frame.filename).parents and Path(frame.filename).is_file()
    ]
    if not frames:
        return ""
    own: list[traceback.FrameSummary] = []
    for home in (_folder_of(owner), Path(frames[0].filename).parent):
        if home is not None and not own:
            is_installed = _INSTALLED in home.parts
            own = [frame for frame in frames if _is_of(Path(frame.filename), home, is_installed)]
    return f"{own[-1].filename}:{own[-1].lineno}, in {own[-1].name}"


def _folder_of(owner: type | None) -> Path | None:
    """Where a class is written; `None` for those of the orchestrator, which stand for others."""
    module = sys.modules.get(owner.__module__) if owner is not None else None
    file = getattr(module, "__file__", None)
    folder = None if file is None else Path(file).resolve().parent
    return None if folder is None or folder == _HERE or _HERE in folder.parents else folder


def _is_of(file: Path, home: Path, is_installed: bool) -> bool:  # noqa: FBT001 - of one caller
    return home in file.parents and (is_installed or _INSTALLED not in file.parts)
