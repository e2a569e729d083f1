"""The beginning of a run, tried in a process of its own: what only SUMO with its net can tell.

Whether a lane leads on, ways cross, everybody finds room and antennas are outdoors. Nothing that
the scene writes is written. `python -m adapters.sumo.rehearsal RESULT` is that process; it reads
the pickled parameters and options from standard input.
"""

import json
import os
import pickle
import re
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from adapters.sumo.files import SceneFiles
from adapters.sumo.parameters import TrafficParameters
from adapters.sumo.silencing import StandIns
from orchestrator.errors import ParameterProblem
from orchestrator.remote.process import child_environment
from orchestrator.scratch import scratch

_SEED: Final = 1
"""One draw of many: what has no room by chance alone is told as in a run with this seed."""

_PLACE: Final = re.compile(r"`(entities\.[^`]+)`(?: is)?:? *(.*)", re.DOTALL)
"""An entity or one of its parameters, and what is wrong."""

_BENEATH: Final = re.compile(r"`([a-z_.]+)`(?:: )?")
"""A parameter of the entity, if what is wrong begins with one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rehearsal:
    """What was seen, as far as the parameters can help.

    Attributes:
        problems: what ends a run before its first communication point.
        remarks: what is not wrong, but may not be meant.
    """

    problems: tuple[ParameterProblem, ...] = ()
    remarks: tuple[ParameterProblem, ...] = ()


def rehearse(
    parameters: TrafficParameters, files: SceneFiles, *, timeout: float = 300.0
) -> Rehearsal:
    """What happens before the first communication point of a run.

    Args:
        parameters: of the component, without fault so far.
        files: of the scene, which SUMO can open.
        timeout: for all of it [s]; one that takes longer tells nothing.
    """
    with scratch("rehearsal") as folder:
        options = StandIns(files, folder).options()
        result = folder / "result.json"
        try:
            subprocess.run(
                [sys.executable, "-P", "-m", "adapters.sumo.rehearsal", str(result)],
                input=pickle.dumps((parameters, options)),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=timeout,
                check=False,
                env=child_environment(),
            )
        except subprocess.TimeoutExpired:
            return Rehearsal()
        noted: Mapping[str, Any] = json.loads(result.read_text("utf-8")) if result.exists() else {}
    return Rehearsal(
        problems=tuple(_located(line, parameters) for line in noted.get("problems", ())),
        remarks=tuple(_located(line, parameters) for line in noted.get("remarks", ())),
    )


def _located(line: str, parameters: TrafficParameters) -> ParameterProblem:
    """A sentence at the parameter that it begins with, as far as that is declared."""
    match = _PLACE.match(line)
    if match is None:
        return ParameterProblem(("scene",), line)
    path, what = match.groups()
    beneath = _BENEATH.match(what)
    address: list[str] = path.split(".")[:1]
    value: Any = parameters.entities
    keys = path.split(".")[1:] + (beneath[1].split(".") if beneath else [])
    for key in keys:
        value = value.get(key) if isinstance(value, Mapping) else getattr(value, key, None)
        if value is None:
            break
        address.append(key)
    if beneath is not None and beneath[0].endswith(": "):
        what = what[beneath.end() :]
    return ParameterProblem(tuple(address), what or line)


def main(result: Path, parameters: TrafficParameters, options: Sequence[str]) -> None:
    """Begin a run and note what is wrong with it.

    Args:
        result: the file to write: a JSON object whose `problems` and `remarks` are sentences.
        parameters: of the component.
        options: of SUMO, with which it writes nothing.
    """
    os.dup2(2, 1)  # both SUMO and the import of libsumo print
    from adapters.sumo.component import SumoTraffic  # noqa: PLC0415 - only now it may print
    from adapters.sumo.errors import SumoError  # noqa: PLC0415 - likewise

    problems: list[str] = []
    remarks: Sequence[str] = ()
    try:
        remarks = SumoTraffic.rehearse(parameters, options, _SEED)
    except SumoError as error:
        problems = str(error).splitlines()
    noted = {"problems": problems, "remarks": [*remarks]}
    result.write_text(json.dumps(noted), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), *pickle.load(sys.stdin.buffer))  # noqa: S301 - of our own process
