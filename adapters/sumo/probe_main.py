"""The process in which SUMO opens a scene: `python -m adapters.sumo.probe_main RESULT OPTION ...`.

`RESULT` becomes a JSON file: `stage` is `loading`, `stepping` or `done`, also when SUMO crashes;
`error` is the text of SUMO's exception, or `null`. What SUMO prints goes to standard error.
"""

import json
import os
import sys
from pathlib import Path

from adapters.sumo.errors import SumoError
from adapters.sumo.headless import import_libsumo


def main(result: Path, options: list[str]) -> None:
    """Open a scene and simulate one step.

    Args:
        result: the file to write.
        options: of SUMO.
    """
    os.dup2(2, 1)  # both SUMO and the import of libsumo print

    def note(stage: str, error: str | None = None) -> None:
        result.write_text(json.dumps({"stage": stage, "error": error}), encoding="utf-8")

    stage = "loading"
    note(stage)
    try:
        libsumo = import_libsumo()
    except SumoError as error:
        note(stage, str(error))
        return
    try:
        libsumo.start(["sumo", *options])
        stage = "stepping"
        note(stage)
        libsumo.simulationStep()
        libsumo.close()
    except (libsumo.TraCIException, libsumo.FatalTraCIError) as error:
        note(stage, str(error))
    else:
        note("done")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
