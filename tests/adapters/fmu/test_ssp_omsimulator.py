"""What OMSimulator opens: its reader refuses names and annotations that SSP allows."""

import csv
import os
import re
import subprocess
import zipfile
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from lxml import etree

from orchestrator.cli import main
from orchestrator.recording.reader import Recording
from orchestrator.scenario.document import Document
from tests.adapters.fmu.test_ssp import PAIR, exported, fingerprint, round_trip, written

PROGRAM: Final = os.environ.get("NLOSIM_OMSIMULATOR", "")
"""The command line program of OMSimulator, which no package index has."""

NAMES: Final = (
    PAIR.replace("  a:", "  a-1:")
    .replace("  b:", "  a_1:")
    .replace("from: a.x, to: b.u", "from: a-1.x, to: a_1.u")
)
"""Two names of which one identifier would be made."""

IDENTIFIER: Final = re.compile(r"[a-zA-Z][a-zA-Z0-9_]*")
"""OMSimulator 3, `ComRef.cpp`."""

READ: Final = {
    "SystemStructureDescription": {"System", "Units", "Enumerations", "DefaultExperiment"},
    "Component": {"Connectors", "ElementGeometry", "ParameterBindings"},
}
"""The elements that its reader knows there; with any other one nothing is opened."""


@pytest.mark.parametrize("version", ["1.0", "2.0"])
@pytest.mark.parametrize("text", [PAIR, NAMES], ids=["letters", "hyphens"])
def test_a_package_has_nothing_that_its_reader_refuses(
    lag2: Path, tmp_path: Path, text: str, version: str
) -> None:
    path = exported(tmp_path, lag2, text, version)
    root = etree.fromstring(zipfile.ZipFile(path).read("SystemStructure.ssd"))
    named = [root, *root.iter("{*}System"), *root.iter("{*}Component")]
    names = [each.get("name") for each in named if etree.QName(each).namespace in root.nsmap["ssd"]]
    assert len(names) == 4
    assert [name for name in names if not IDENTIFIER.fullmatch(name)] == []
    assert len(set(names[2:])) == 2
    for kind, known in READ.items():
        for each in root.iter(f"{{{root.nsmap['ssd']}}}{kind}"):
            assert {etree.QName(child).localname for child in each} <= known
    # of annotations of the system it reads the first one only
    first = root.find("{*}System/{*}Annotations/{*}Annotation")
    assert first.get("type") == "org.openmodelica"
    ends = {
        each.get(f"{end}Element") for each in root.iter("{*}Connection") for end in ("start", "end")
    }
    assert ends == set(names[2:])


def test_names_that_are_no_identifiers_come_back(lag2: Path, tmp_path: Path) -> None:
    path = written(tmp_path, lag2, NAMES)
    back = round_trip(path, tmp_path, "1.0")
    assert list(Document.read(back).data["components"]) == ["a-1", "a_1"]
    assert Document.read(back).data["title"] == "A chain"
    assert fingerprint(back, tmp_path / "1") == fingerprint(path, tmp_path / "2")


@pytest.mark.skipif(not PROGRAM, reason="NLOSIM_OMSIMULATOR is not the program of OMSimulator")
@pytest.mark.parametrize("version", ["1.0", "2.0"])
@pytest.mark.parametrize(("text", "second"), [(PAIR, "b"), (NAMES, "a_1")])
def test_omsimulator_runs_a_package_to_the_same_numbers(
    lag2: Path, tmp_path: Path, text: str, second: str, version: str
) -> None:
    path = exported(tmp_path, lag2, text, version)
    result = tmp_path / "result.csv"
    where = (f"--resultFile={result}", f"--tempDir={tmp_path}")
    words = (PROGRAM, str(path), "--stopTime=2", *where)
    outcome = subprocess.run(words, capture_output=True, text=True, timeout=60, check=True)
    assert "0 errors" in outcome.stdout
    rows = list(csv.DictReader(result.read_text().splitlines(), skipinitialspace=True))
    column = f"pair.pair.{second}.x"  # of the model and its system
    theirs = {round(float(row["time"]), 6): float(row[column]) for row in rows}
    scenario = tmp_path / "pair.yaml"
    assert (
        main(["run", str(scenario), "--no-figure", "--out", str(tmp_path / "run"), "--quiet"]) == 0
    )
    ours = Recording(tmp_path / "run")[f"{second}.x"]
    times = [20_000_000 * k for k in range(101)]
    found = np.array([float(ours.at(t)) for t in times])
    assert np.ptp(found) > 0.1
    np.testing.assert_allclose(found, [theirs[round(t / 1e9, 6)] for t in times], rtol=1e-11)
