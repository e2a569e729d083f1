"""Scenarios as packages and back, and the runs of FMPy."""

import math
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy.ssp
import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd
from lxml import etree

from adapters.ssp_command import add_command
from orchestrator.cli import main
from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.recording.reader import Recording
from orchestrator.scenario.document import Document
from tests.commands import executed

SCENARIO = """\
schema: 1
title: "Two lags: a & b"
description: Of order one
time: {{start: 0.5 s, stop: 2 s, until: b.flag_out}}
seed: 7
coupling: {{algorithm: gauss-seidel, order: [b, a]}}
components:
  b:
    fmu: lag2.fmu
    step: 20 ms
    parameters: {{method: Forward Euler, time_constant: 300 ms, fmi.tolerance: 1e-4}}
  a:
    fmu: lag2.fmu
    step: 10 ms
    process: on-request
    deadline: {{step: 7 s}}
    memory: 2 GB
    parameters: {{start.flag_in: true, fmi.locals: [stop]}}
connections:
  - {{from: a.x, to: b.u{way}}}
  - {{value: 3.5, to: a.u}}
  - {{from: b.count_out, to: a.count_in}}
recording: {{exclude: [b.rollback]}}
"""
ARRAYS = """\
schema: 1
title: Arrays
time: {stop: 1 s}
components:
  table:
    fmu: table.fmu
    step: 100 ms
    parameters:
      n_sample: 4
      sample.gain: [0 dB, 3 dB, 6, -3 dB]
      sample.colour: [red, green, blue, red]
      interpolation: linear
"""


def ssp(*words: str | Path) -> Outcome:
    return executed(add_command, "ssp", *map(str, words))


def written(folder: Path, fmu: Path, text: str) -> Path:
    (folder / fmu.name).write_bytes(fmu.read_bytes())
    path = folder / "pair.yaml"
    path.write_text(text)
    return path


def fingerprint(path: Path, out: Path) -> str:
    assert main(["run", str(path), "--no-figure", "--out", str(out), "--quiet"]) == 0
    found: str = Document.read(out / "manifest.json").data["fingerprint"]
    return found


def round_trip(path: Path, folder: Path, version: str) -> Path:
    """The scenario of the package of a scenario."""
    package = folder / "pair.ssp"
    outcome = ssp("export", path, "-o", package, "--version", version)
    assert outcome.exit_code is Exit.DONE, outcome.text
    outcome = ssp("import", package, "-o", folder / "back")
    assert outcome.exit_code is Exit.DONE, outcome.text
    return folder / "back/pair.yaml"


@pytest.mark.parametrize(
    ("version", "way"),
    [
        ("1.0", ", gain: -2.5, offset: 0.1"),
        ("2.0", ", convert: false, gain: 3"),
        ("1.0", ", delay: 30 ms"),
        ("2.0", ", sample: 40 ms, gain: 1e-7"),
    ],
)
def test_a_scenario_as_a_package_and_back_gives_the_same_bytes(
    lag2: Path, tmp_path: Path, version: str, way: str
) -> None:
    path = written(tmp_path, lag2, SCENARIO.format(way=way))
    back = round_trip(path, tmp_path, version)
    assert fingerprint(back, tmp_path / "1") == fingerprint(path, tmp_path / "2")
    first, second = (Document.read(each).data for each in (path, back))
    for key in ("title", "description", "seed", "coupling", "recording"):
        said = {"include": ["*"], **first[key]} if key == "recording" else first[key]
        assert second[key] == said
    assert second["time"] == {"start": "500 ms", "stop": "2 s", "until": "b.flag_out"}
    assert list(second["components"]) == ["b", "a"]
    for key, value in (
        ("process", "on-request"),
        ("memory", "2 GB"),
        ("deadline", {"step": "7 s"}),
    ):
        assert second["components"]["a"][key] == value
        assert key == "process" or key not in second["components"]["b"]


def test_arrays_go_with_ssp_2(fmu: Callable[[str], Path], tmp_path: Path) -> None:
    path = written(tmp_path, fmu("table"), ARRAYS)
    back = round_trip(path, tmp_path, "2.0")
    assert fingerprint(back, tmp_path / "1") == fingerprint(path, tmp_path / "2")
    outcome = ssp("export", path, "-o", tmp_path / "old.ssp", "--version", "1.0")
    assert outcome.exit_code is Exit.WRONG_INPUT
    said = f"{path}:5:3: SSP 1.0 cannot say `corner` (an array), `colour` (of the type Int64), "
    assert said in outcome.text
    assert outcome.text.endswith("`sample.gain` (an array) and 2 more; write `--version 2.0`")
    assert not (tmp_path / "old.ssp").exists()


def exported(folder: Path, fmu: Path, text: str, version: str = "1.0") -> Path:
    path = folder / "pair.ssp"
    outcome = ssp("export", written(folder, fmu, text), "-o", path, "--version", version)
    assert outcome.exit_code is Exit.DONE, outcome.text
    return path


def test_a_package_is_what_the_schemas_of_ssp_1_allow(lag2: Path, tmp_path: Path) -> None:
    path = exported(tmp_path, lag2, SCENARIO.format(way=", gain: 2, delay: 20 ms"))
    ssd = read_ssd(path)  # against the schema
    assert [each.name for each in ssd.system.elements] == ["b", "a"]
    root = etree.fromstring(zipfile.ZipFile(path).read("SystemStructure.ssd"))
    assert set(root.nsmap) == {"ssc", "ssd", "ssv", "nlosim"}
    folder = Path(fmpy.ssp.__file__).parent / "schema"
    schema = etree.XMLSchema(file=str(folder / "SystemStructureParameterValues.xsd"))
    sets = list(root.iter("{*}ParameterSet"))
    assert len(sets) == 2
    for each in sets:
        schema.assertValid(each)
    assert {unit.get("name") for unit in root.iter("{*}Unit")} == {"s", "V"}


def test_a_package_is_what_the_schemas_of_ssp_2_allow(
    fmu: Callable[[str], Path], tmp_path: Path
) -> None:
    library = pytest.importorskip("pyssp_standard", reason="carries the schemas of SSP 2.0")
    path = exported(tmp_path, fmu("table"), ARRAYS, "2.0")
    root = etree.fromstring(zipfile.ZipFile(path).read("SystemStructure.ssd"))
    folder = Path(library.__file__).parent / "resources" / "ssp2"
    for name, element in (
        ("Description", root),
        ("ParameterValues", next(root.iter("{*}ParameterSet"))),
    ):
        etree.XMLSchema(file=str(folder / f"SystemStructure{name}.xsd")).assertValid(element)


def test_the_same_scenario_gives_the_same_package(lag2: Path, tmp_path: Path) -> None:
    first = exported(tmp_path, lag2, SCENARIO.format(way="")).read_bytes()
    assert exported(tmp_path, lag2, SCENARIO.format(way="")).read_bytes() == first


def test_a_step_that_all_share_is_there_for_omsimulator(lag2: Path, tmp_path: Path) -> None:
    """Where version 2 looks for it, and where version 3 does."""
    path = exported(tmp_path, lag2, PAIR)
    root = etree.fromstring(zipfile.ZipFile(path).read("SystemStructure.ssd"))
    assert root.nsmap["oms"].endswith("oms.xsd")
    (master,) = root.iter("{*}FixedStepMaster")
    assert master.get("stepSize") == "0.02"
    information = master.getparent()
    assert dict(information.attrib) == {
        "name": "oms_ma_default", "method": "oms_ma", "fixedStepSize": "0.02"
    }  # fmt: skip


def test_what_only_nlosim_reads_is_told_at_its_place(lag2: Path, tmp_path: Path) -> None:
    path = written(tmp_path, lag2, SCENARIO.format(way=", delay: 20 ms"))
    outcome = ssp("export", path, "-o", tmp_path / "pair.ssp")
    places = [line.split(": ")[0] for line in outcome.text.splitlines() if "(a remark)" in line]
    assert places == [f"{path}:{n}" for n in ("5:1", "6:1", "7:1", "20:5", "23:1")]


PARTS = """\
from orchestrator.component import Component


class Wheel(Component):
    '''A wheel.'''

    connectors = {}

    def setup(self, start, rng):
        pass

    def step(self, inputs, t, h):
        pass

    def outputs(self):
        return {}
"""


def test_what_ssp_cannot_say_is_refused_at_its_line(
    lag2: Path, fmu: Callable[[str], Path], tmp_path: Path
) -> None:
    (tmp_path / "parts.py").write_text(PARTS)
    (tmp_path / "mirror.fmu").write_bytes(fmu("table").read_bytes())
    text = SCENARIO.format(way="").replace(
        "connections:\n", "  wheel: {type: 'parts:Wheel', step: 10 ms}\nconnections:\n"
    )
    text = text.replace("{from: a.x, to: b.u}", "{sum: [a.x, b.x], to: b.u}")
    text = text.replace(", order: [b, a]", "")
    path = written(tmp_path, lag2, text)
    outcome = ssp("export", path, "-o", tmp_path / "pair.ssp")
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert f"{path}:19:3: `wheel` is parts:Wheel, no FMU" in outcome.text
    assert f"{path}:21:17: a sum: an input of SSP has one source" in outcome.text
    assert not (tmp_path / "pair.ssp").exists()


PAIR = """\
schema: 1
title: A chain
time: {stop: 2 s}
coupling: {algorithm: jacobi}
components:
  a: {fmu: lag2.fmu, step: 20 ms}
  b: {fmu: lag2.fmu, step: 20 ms}
connections:
  - {from: a.x, to: b.u}
"""


def without_texts(path: Path, target: Path) -> Path:
    """The package without connectors of the type String, which FMPy's runner does not know."""
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == "SystemStructure.ssd":
                root = etree.fromstring(content)
                for text in root.findall(".//{*}Connector/{*}String"):
                    connector = text.getparent()
                    connector.getparent().remove(connector)
                content = etree.tostring(root)
            new.writestr(name, content)
    return target


def test_the_runner_of_fmpy_says_the_same(lag2: Path, tmp_path: Path) -> None:
    """Both delay a connection by a step. FMPy's sets inputs to 0 in the first one, whatever drives
    them, so that `b` begins lower by 1 - exp(-h / T); from then on the difference decays as `b`
    does. Its rows carry the time at which their step began."""
    path = exported(tmp_path, lag2, PAIR)
    numbers = without_texts(path, tmp_path / "numbers.ssp")
    theirs = simulate_ssp(str(numbers), stop_time=2.0 - 1e-9, step_size=0.02)
    outcome = ssp("import", path, "-o", tmp_path / "back")
    back = str(outcome.data["scenario"])
    assert main(["run", back, "--no-figure", "--out", str(tmp_path / "run"), "--quiet"]) == 0
    run = Recording(tmp_path / "run")
    times = [20_000_000 * k for k in range(1, 101)]
    ours: dict[str, Any] = {n: [float(run[n].at(t)) for t in times] for n in ("a.x", "b.x")}
    np.testing.assert_array_equal(theirs["a.x"], ours["a.x"])
    step = math.exp(-0.02 / 2)
    lower = [(1 - step) * step**k for k in range(100)]
    np.testing.assert_allclose(np.array(ours["b.x"]) - theirs["b.x"], lower, rtol=1e-11)


def test_a_variable_inside_that_drives_others_goes_with_ssp_2(lag2: Path, tmp_path: Path) -> None:
    options = "parameters: {fmi.locals: [s*, tolerance]}"
    text = PAIR.replace("ms}", f"ms, {options}}}", 1)
    text = text.replace("from: a.x, to: b.u", "from: a.stop, to: b.u, convert: false")
    path = written(tmp_path, lag2, text)
    outcome = ssp("export", path, "-o", tmp_path / "old.ssp")
    assert f"{path}:6:3: SSP 1.0 cannot say `stop` (a connector of the kind local);" in outcome.text
    back = round_trip(path, tmp_path, "2.0")
    assert fingerprint(back, tmp_path / "1") == fingerprint(path, tmp_path / "2")
    said = Document.read(back).data["components"]["a"]["parameters"]["fmi.locals"]
    assert said == ["s*", "tolerance", "stop"]


def test_a_step_that_is_a_fraction_comes_back_exactly(lag2: Path, tmp_path: Path) -> None:
    path = written(tmp_path, lag2, PAIR.replace("20 ms", "1/60 s"))
    back = round_trip(path, tmp_path, "1.0")
    assert {each["step"] for each in Document.read(back).data["components"].values()} == {"1/60 s"}


BALL = """\
schema: 1
title: A ball
time: {{stop: 1 s}}
components:
  ball:
    fmu: {fmu}
    step: 10 ms
    parameters: {{start.h: 2, e: 0.5, fmi.solver: euler, fmi.step: 5 ms}}
"""


def test_an_fmu_for_model_exchange_is_one_in_the_package(ball: Path, tmp_path: Path) -> None:
    path = written(tmp_path, ball, BALL.format(fmu=ball.name))
    back = round_trip(path, tmp_path, "1.0")
    with zipfile.ZipFile(tmp_path / "pair.ssp") as archive:
        root = etree.fromstring(archive.read("SystemStructure.ssd"))
    (component,) = root.iterfind(".//{*}Elements/{*}Component")
    assert component.get("implementation") == "ModelExchange"
    assert fingerprint(back, tmp_path / "1") == fingerprint(path, tmp_path / "2")
    said = Document.read(back).data["components"]["ball"]["parameters"]
    assert said["start.h"] == 2.0
    assert said["fmi.solver"] == "euler"
