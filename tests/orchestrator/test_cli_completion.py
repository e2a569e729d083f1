"""Shell completion: what a shell offers is what the command line takes."""

import shutil
import subprocess
from pathlib import Path

import pytest

from orchestrator.cli import main
from orchestrator.cli.parser import parser

BASH = shutil.which("bash")


def script(shell: str, capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["completion", shell]) == 0
    return capsys.readouterr().out


def offered(text: str, folder: Path, *words: str) -> list[str]:
    """What bash completes the last of `words` to."""
    assert BASH is not None
    (folder / "nlosim.bash").write_text(text)
    quoted = " ".join(f"'{word}'" for word in ("nlosim", *words))
    program = (
        f"source {folder}/nlosim.bash; COMP_WORDS=({quoted}); COMP_CWORD={len(words)}; _nlosim; "
        'printf "%s\\n" "${COMPREPLY[@]}"'
    )
    command = [BASH, "--noprofile", "--norc", "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert not done.stderr
    return done.stdout.split()


@pytest.mark.skipif(BASH is None, reason="there is no bash")
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["ru"], ["run"]),
        (["run", "red_light_d"], ["red_light_driving"]),
        (["run", "red_light", "--se"], ["--set", "--seed"]),
        (["run", "--json", "red_light", "--qu"], ["--quiet"]),
        (["fmu", "bui"], ["build"]),
        (["fmu", "build", "--js"], ["--json"]),
        (["components", "sumo"], ["sumo-traffic"]),
        (["completion", ""], ["bash", "zsh", "fish", "--help", "--json"]),
        (["export", "runs/a", "--mc"], ["--mcap"]),
        (["check", "some_file"], []),
        (["run", "run", "--transp"], ["--transport"]),
    ],
)
def test_bash_completes(
    words: list[str], expected: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = offered(script("bash", capsys), tmp_path, *words)
    assert set(expected) <= set(found)
    assert all(each.startswith(words[-1]) for each in found)
    assert len(found) == len(expected) or words[-1] in ("", "red_light_d")


@pytest.mark.skipif(BASH is None, reason="there is no bash")
def test_bash_knows_every_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = offered(script("bash", capsys), tmp_path, "")
    help_text = parser().format_help()
    commands = [each for each in found if not each.startswith("--")]
    assert {"run", "check", "graph", "components", "experiment", "verify", "bench"} <= set(commands)
    assert all(f"    {each} " in help_text or f"    {each}\n" in help_text for each in commands)


def test_fish_has_a_line_for_each_and_zsh_the_script_of_bash(
    capsys: pytest.CaptureFixture[str],
) -> None:
    fish = script("fish", capsys)
    assert "-a 'run' " in fish or "-a run " in fish
    assert "'__fish_seen_subcommand_from run' -l seed -d" in fish
    assert all(line.startswith(("complete -c nlosim -n ", "#")) for line in fish.splitlines())
    bash, zsh = script("bash", capsys), script("zsh", capsys)
    assert "bashcompinit" in zsh
    assert zsh.endswith(bash.split("\n", 1)[1])


@pytest.mark.parametrize("shell", ["fish", "zsh"])
def test_other_shells_take_the_script(
    shell: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    program = shutil.which(shell)
    if program is None:
        pytest.skip(f"there is no {shell}")
    path = tmp_path / "script"
    path.write_text(script(shell, capsys))
    done = subprocess.run([program, "-n", str(path)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_other_shells_are_wrong_input(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "bsh"]) == 2
    assert "no shell `bsh`; did you mean `bash`?" in capsys.readouterr().err
