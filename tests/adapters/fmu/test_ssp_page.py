"""The example of docs/ssp.md: the package becomes the scenario that the page shows, and back."""

import re
import shlex
import zipfile
from pathlib import Path

import pytest

from orchestrator.cli import main
from orchestrator.scenario.document import Document

PAGE = (Path(__file__).parents[3] / "docs" / "ssp.md").read_text()
RENAMED = {
    "motion": (("u", "acceleration", "m/s2"), ("x", "speed", "m/s")),
    "driver": (
        ("u", "speed", "km/h"), ("x", "acceleration", "m/s2"), ("time_constant", "reaction", "s"),
    ),
}  # fmt: skip
UNITS = """\
    <Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit>
    <Unit name="m/s2"><BaseUnit m="1" s="-2"/></Unit>
    <Unit name="km/h"><BaseUnit m="1" s="-1" factor="0.2777777777777778"/></Unit>
  </UnitDefinitions>"""


def block(kind: str) -> str:
    (found,) = re.findall(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL)
    return str(found)


def called(lag2: Path, name: str) -> bytes:
    """The FMU `lag2` with other names and units for some of its variables."""
    with zipfile.ZipFile(lag2) as archive:
        contents = {each: archive.read(each) for each in archive.namelist()}
    text = contents["modelDescription.xml"].decode().replace("  </UnitDefinitions>", UNITS)
    for old, new, unit in RENAMED[name]:
        text, count = re.subn(
            rf'name="{old}"(.*?unit=")[^"]*', rf'name="{new}"\g<1>{unit}', text, flags=re.DOTALL
        )
        assert count == 1
    contents["modelDescription.xml"] = text.encode()
    path = lag2.parent / f"{name}.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        for each, data in contents.items():
            archive.writestr(each, data)
    return path.read_bytes()


def test_the_example_of_the_page(
    lag2: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    with zipfile.ZipFile(tmp_path / "car.ssp", "w") as archive:
        archive.writestr("SystemStructure.ssd", block("xml"))
        for name in RENAMED:
            archive.writestr(f"resources/{name}.fmu", called(lag2, name))
    monkeypatch.chdir(tmp_path)
    for line in block("sh").splitlines():
        assert main(shlex.split(line)[1:]) == 0, capsys.readouterr()
    assert (tmp_path / "car/car.yaml").read_text() == block("yaml")
    assert main(["ssp", "import", "again.ssp"]) == 0
    assert main(["run", "again/again.yaml", "--out", "second"]) == 0
    first, second = (Document.read(tmp_path / f"{n}/manifest.json").data for n in ("run", "second"))
    assert first["fingerprint"] == second["fingerprint"]
