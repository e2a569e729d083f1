"""Outputs of a scene: whether SUMO can write them."""

import os
from collections.abc import Iterator

from adapters.sumo.files import SceneFiles, resolved
from orchestrator.errors import Problem


def unwritable(files: SceneFiles) -> Iterator[Problem]:
    """Outputs that SUMO could not write: it makes no folders."""
    prefix = files.settings.get("output-prefix")  # may have folders of its own
    for each in files.outputs:
        name = each.path.name if prefix is None else prefix.value + each.path.name
        folder = resolved(each.path.parent, name).parent
        if not folder.is_dir():
            what = f"`{each.named_by}`: the folder {folder} does not exist; make it, or write NUL"
            yield Problem(each.where, what)
        elif not os.access(folder, os.W_OK):
            what = f"`{each.named_by}`: nothing can be written to the folder {folder}"
            yield Problem(each.where, what)
