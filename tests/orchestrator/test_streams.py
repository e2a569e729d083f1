"""Standard output that is full, closed or ASCII costs no result, and never a traceback."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.cli.streams import tell

FULL = Path("/dev/full")
pytestmark = pytest.mark.skipif(not FULL.exists(), reason="no device that is always full")

NLOSIM = f"'{sys.executable}' -m orchestrator"


def shell(command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["sh", "-c", command],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **environment},
    )


@pytest.mark.parametrize("arguments", ["scenarios --json", "--help", "nonsense"])
def test_output_that_cannot_be_written_is_one_sentence_and_wrong_input(arguments: str) -> None:
    done = shell(f"{NLOSIM} {arguments} >/dev/full")
    assert done.returncode == 2
    if arguments != "nonsense":
        assert done.stderr == ("error: cannot write to standard output: No space left on device\n")
    assert shell(f"{NLOSIM} {arguments} >/dev/full 2>/dev/full").returncode == 2


@pytest.mark.parametrize("closed", ["2>&-", "<&- >&- 2>&-"])
def test_streams_that_are_closed_change_nothing(closed: str) -> None:
    done = shell(f"{NLOSIM} scenarios {closed}")
    assert done.returncode == 0
    assert ("red_light" in done.stdout) == (">&-" not in closed.replace("2>&-", ""))
    assert "Traceback" not in done.stderr


def test_a_file_that_is_opened_does_not_become_standard_output(tmp_path: Path) -> None:
    """Else it would get what libraries print."""
    code = (
        "import sys, os; from orchestrator.cli import streams; streams.prepare(); "
        f"file = open(r'{tmp_path / 'precious'}', 'w'); os.write(1, b'noise'); file.close()"
    )
    assert shell(f'{sys.executable} -c "{code}" >&-').returncode == 0
    assert (tmp_path / "precious").read_text() == ""


def test_what_an_encoding_lacks_is_escaped(tmp_path: Path) -> None:
    """The name of the file comes back in the message."""
    name = tmp_path / "größe.yaml"
    name.write_text("schema: 2\n", encoding="utf-8")
    done = shell(f"{NLOSIM} check '{name}'", PYTHONIOENCODING="ascii")
    assert done.returncode == 2
    assert r"gr\xf6\xdfe.yaml:1:" in done.stdout


def test_a_failure_keeps_its_exit_code(monkeypatch: pytest.MonkeyPatch) -> None:
    """That nothing can be told of it does not make it another failure."""
    for code, expected in ((Exit.DONE, 2), (Exit.COMPONENT_FAILED, 3)):
        with FULL.open("w") as nowhere:
            monkeypatch.setattr(sys, "stdout", nowhere)
            assert tell(Outcome(text="", data={}, exit_code=code), is_json=True) == expected
            monkeypatch.undo()


def test_nobody_who_reads_on_is_no_error() -> None:
    done = shell(f"{NLOSIM} scenarios | true")
    assert (done.returncode, done.stderr) == (0, "")
