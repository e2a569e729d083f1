"""The product as users get it: a wheel, alone in an empty environment."""

import json
import subprocess
import sys
import zipfile
from importlib.metadata import distribution, packages_distributions
from pathlib import Path

import pytest
from fmpy.validation import validate_fmu

from fmus.native.targets import TARGETS
from fmus.native.unit import UNITS

ROOT = Path(__file__).parents[1]


def run(*command: str | Path, cwd: Path) -> str:
    """The standard output of a command that must succeed."""
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def tracked_files() -> list[str]:
    return run("git", "ls-files", "--cached", "--others", "--exclude-standard", cwd=ROOT).split()


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel built from a clean checkout: only files that git knows or would take.

    What builds it is that of the environment; that `build-system.requires` is enough is shown by
    the installation of the environment itself, which is an isolated build.
    """
    checkout = tmp_path_factory.mktemp("checkout")
    for name in tracked_files():
        source, target = ROOT / name, checkout / name
        if source.is_file():
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(source.read_bytes())
    assert not list(checkout.rglob("*.fmu"))
    out = tmp_path_factory.mktemp("dist")
    options = ["--no-deps", "--no-build-isolation", "--quiet", "--wheel-dir", str(out)]
    run(sys.executable, "-m", "pip", "wheel", *options, ".", cwd=checkout)
    (found,) = out.glob("nlosim-*.whl")
    return found


@pytest.mark.slow
def test_a_wheel_contains_the_fmus_and_the_scenarios(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    for unit in ("channel", "lidar", "perception"):
        assert f"fmus/{unit}/{unit}.fmu" in names
    for folder in ("scenarios/", "studies/"):
        shipped = {name for name in tracked_files() if name.startswith(folder)}
        assert any(name.endswith(".yaml") for name in shipped)
        assert shipped <= names
    assert not any(name.startswith(("tests/", "docs/")) for name in names)


@pytest.mark.slow
@pytest.mark.parametrize("unit", UNITS)
def test_a_wheel_has_every_unit_for_every_platform(wheel: Path, unit: str, tmp_path: Path) -> None:
    path = tmp_path / f"{unit}.fmu"
    path.write_bytes(zipfile.ZipFile(wheel).read(f"fmus/{unit}/{unit}.fmu"))
    assert validate_fmu(str(path)) == []
    with zipfile.ZipFile(path) as archive:
        heads = {
            target.platform: archive.read(f"binaries/{target.platform}/{unit}{target.suffix}")[:4]
            for target in TARGETS
        }
    assert heads == {
        "x86_64-linux": b"\x7fELF",
        "aarch64-linux": b"\x7fELF",
        "x86_64-windows": b"MZ\x78\x00",
        "aarch64-darwin": b"\xcf\xfa\xed\xfe",
    }


@pytest.mark.slow
def test_a_wheel_works_alone_in_an_empty_environment(wheel: Path, tmp_path: Path) -> None:
    """Install it with its dependencies, leave the checkout, check and run a scenario."""
    run(sys.executable, "-m", "venv", tmp_path / "env", cwd=tmp_path)
    python = tmp_path / "env" / "bin" / "python"
    run(
        python,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-compile",  # of what is not imported
        "--disable-pip-version-check",
        wheel,
        cwd=tmp_path,
    )
    scenario = run(
        python,
        "-c",
        "from importlib.resources import files; print(files('scenarios') / 'red_light.yaml')",
        cwd=tmp_path,
    ).strip()
    nlosim = tmp_path / "env" / "bin" / "nlosim"
    listed = json.loads(run(nlosim, "scenarios", "--json", cwd=tmp_path))["scenarios"]
    assert {row["name"]: row["path"] for row in listed}["red_light"] == scenario
    assert all(row["error"] is None for row in listed)
    for given in (scenario, "red_light"):
        assert json.loads(run(nlosim, "check", given, "--json", cwd=tmp_path)) == {"problems": []}
    result = json.loads(
        run(nlosim, "run", "red_light", "--set", "time.stop=1 s", "--json", cwd=tmp_path)
    )
    assert result["out"] == "runs/red_light-1"
    assert (tmp_path / result["out"] / "manifest.json").is_file()


def test_the_four_packages_are_ours() -> None:
    """Another distribution on the package index also installs a folder called `adapters`."""
    owners = packages_distributions()
    for package in ("orchestrator", "fmus", "adapters", "scenarios"):
        assert set(owners.get(package, ["nlosim"])) == {"nlosim"}
    assert distribution("nlosim").metadata["License-Expression"] == "Apache-2.0"
