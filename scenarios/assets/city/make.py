"""Makes the nets, buildings and demands of the two cities; `make net` runs it.

python -m scenarios.assets.city.make [FOLDER]

It needs netgenerate (extra `net`). The same version of SUMO makes the same bytes.
"""

import argparse
import gzip
import re
import shutil
import subprocess
import tempfile
from importlib.util import find_spec
from pathlib import Path
from random import Random
from types import MappingProxyType
from typing import Final

from scenarios.assets.city.demand import demand
from scenarios.assets.city.houses import houses, polygons
from scenarios.assets.city.streets import read_streets, without_header

_EVERYWHERE: Final = (
    "--default.lanenumber", "2", "--default.speed", "13.89", "--default.sidewalk-width", "3",
    "--sidewalks.guess", "true", "--crossings.guess", "true",
    "--junctions.corner-detail", "0", "--write-metadata", "false",
)  # fmt: skip

NETS: Final = MappingProxyType(
    {
        "city": (
            "--grid", "--grid.number", "7", "--grid.length", "150",
            "--default-junction-type", "traffic_light", "--no-turnarounds", "true",
        ),
        "irregular": (
            "--rand", "--rand.iterations", "80", "--rand.min-distance", "90",
            "--rand.max-distance", "200", "--rand.min-angle", "45", "--seed", "7",
            "--random-lanenumber", "true", "--tls.guess", "true",
            "--no-turnarounds.except-deadend", "true",
        ),
    }
)  # fmt: skip
"""What netgenerate is told, by the name of the city."""

_CYCLE: Final = 90
"""Of the lights that netgenerate makes [s]."""


def netgenerate() -> str | None:
    """The program of the package eclipse-sumo, or on the path; `None` if there is none."""
    spec = find_spec("sumo")
    if spec is not None and spec.origin is not None:
        found = shutil.which("netgenerate", path=str(Path(spec.origin).parent / "bin"))
        if found is not None:
            return found
    return shutil.which("netgenerate")


def make(folder: Path, name: str) -> None:
    """Write `NAME.net.xml.gz`, `NAME.poly.xml.gz` and `NAME.rou.xml.gz`.

    Args:
        folder: where to.
        name: of a city in `NETS`.

    Raises:
        FileNotFoundError: netgenerate is not installed.
    """
    program = netgenerate()
    if program is None:
        raise FileNotFoundError("netgenerate is not installed; run `pip install nlosim[net]`")
    with tempfile.TemporaryDirectory() as temporary:
        path = Path(temporary) / "net.xml"
        command = [program, *NETS[name], *_EVERYWHERE, "--output-file", str(path)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        net = without_header(path.read_text(encoding="utf-8"))
    streets = read_streets(net)
    _write(folder / f"{name}.net.xml.gz", _out_of_step(net, _random(name, "lights")))
    _write(folder / f"{name}.poly.xml.gz", polygons(houses(streets, _random(name, "houses"))))
    _write(folder / f"{name}.rou.xml.gz", demand(streets, _random(name, "demand")))


def _random(name: str, what: str) -> Random:
    return Random(f"{name} {what}")  # noqa: S311 - no secret


def _out_of_step(net: str, rng: Random) -> str:
    """The net with lights that do not all turn green at once, as netgenerate has them."""
    return re.sub(r'(<tlLogic [^>]*offset=")0"', lambda it: f'{it[1]}{rng.randrange(_CYCLE)}"', net)


def _write(path: Path, text: str) -> None:
    """Compressed, without name and time."""
    path.write_bytes(gzip.compress(text.encode(), mtime=0))


def main() -> None:
    """Read the arguments and make both cities."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?", default=Path(__file__).parent)
    folder = parser.parse_args().folder
    for name in NETS:
        make(folder, name)


if __name__ == "__main__":
    main()
