"""Where memory is short, the message names the limit of the address space, if there is one."""

import errno
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

from orchestrator.cli import failures, shortage
from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.cli.shortage import LEAST, explained, is_shortage, too_little

MEGABYTE: Final = 1 << 20
LINUX: Final = pytest.mark.skipif(sys.platform != "linux", reason="only there somebody waits")


@pytest.fixture
def limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shortage, "address_space", lambda: 700 * MEGABYTE)


@pytest.fixture
def unlimited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shortage, "address_space", lambda: None)


SHORT: Final = (
    MemoryError(),
    OSError(errno.ENOMEM, "Cannot allocate memory"),
    RuntimeError("can't start new thread"),
    ImportError("libarrow.so: failed to map segment from shared object"),
)


@pytest.mark.parametrize("error", SHORT, ids=lambda error: type(error).__name__)
def test_what_says_that_memory_is_short_is_no_bug(error: Exception) -> None:
    caused = ValueError("the table cannot be read")
    caused.__cause__ = error
    assert is_shortage(error)
    assert is_shortage(caused)
    for each in (error, caused):
        outcome = failures.outcome_of(each)
        assert (outcome.exit_code, outcome.data["error"]["kind"]) == (Exit.WRONG_INPUT, "memory")
        assert "bug" not in outcome.text
    told = failures.bug("its report failed", caused, None)
    assert told.text == "error: its report failed: there is not enough memory"


@pytest.mark.parametrize(
    "error", [ValueError("no"), OSError(errno.ENOENT, "No such file"), ImportError("no module")]
)
def test_other_errors_are_what_they_were(error: Exception) -> None:
    assert not is_shortage(error)


@pytest.mark.parametrize(
    ("allowed", "text", "is_short"),
    [
        (700 * MEGABYTE, "error return without exception set", True),
        (None, "error return without exception set", False),
        (700 * MEGABYTE, "unknown opcode", False),
    ],
)
def test_an_error_that_native_code_did_not_say_is_a_shortage_under_a_limit(
    allowed: int | None, text: str, *, is_short: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """CPython's JSON encoder raised such a `SystemError` where it found no memory for the other."""
    monkeypatch.setattr(shortage, "address_space", lambda: allowed)
    assert is_shortage(SystemError(text)) == is_short


@pytest.mark.usefixtures("limited")
@pytest.mark.parametrize(
    ("kind", "code", "text"),
    [
        ("memory", Exit.WRONG_INPUT, "no memory"),
        ("crash", Exit.COMPONENT_FAILED, "a crash"),
        ("internal", Exit.INTERNAL_ERROR, "a bug"),
        ("scenario", Exit.WRONG_INPUT, "not started: its process was killed by SIGSEGV"),
    ],
)
def test_the_limit_is_named_where_it_may_be_why(kind: str, code: Exit, text: str) -> None:
    outcome = explained(failure(kind, code, text))
    assert outcome.exit_code == code
    assert outcome.text.startswith(f"error: {text}\nnote: this process may have 700 MB of address")
    assert "`ulimit -v`" in outcome.text
    assert outcome.data["error"]["address_space"] == 700 * MEGABYTE
    assert explained(outcome) == outcome


@pytest.mark.usefixtures("limited")
def test_it_is_not_where_something_else_is_wrong() -> None:
    for outcome in (
        Outcome(text="well done", data={"fingerprint": "1"}),
        failure("scenario", Exit.WRONG_INPUT, "`typ` is no key"),
        failure("interrupted", Exit.INTERRUPTED, "interrupted"),
    ):
        assert explained(outcome) == outcome


@pytest.mark.usefixtures("unlimited")
def test_without_a_limit_there_is_none_to_name() -> None:
    outcome = failure("memory", Exit.WRONG_INPUT, "no memory")
    assert explained(outcome) == outcome
    assert too_little() is None


@pytest.mark.parametrize(("allowed", "is_enough"), [(LEAST - 1, False), (LEAST, True)])
def test_less_than_the_least_is_refused(
    allowed: int, *, is_enough: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shortage, "address_space", lambda: allowed)
    assert (too_little() is None) == is_enough


# ---- commands in processes of their own

ENDING = """\
import os
{deed}
class Part: ...
"""
SCENARIO = """\
schema: 1
title: Ends
time: {stop: 1 s}
components:
  part: {type: "parts:Part", step: 100 ms}
"""


def limited_command(kilobytes: str, *arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """`nlosim` with so much address space, or `unlimited`."""
    command = f'ulimit -v {kilobytes}; exec "$0" -m orchestrator "$@"'
    return subprocess.run(
        ["bash", "-c", command, sys.executable, *arguments],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


@LINUX
@pytest.mark.parametrize("command", ["run", "check", "experiment"])
def test_no_command_begins_with_less_than_the_least(tmp_path: Path, command: str) -> None:
    done = limited_command("60000", command, "scenario.yaml", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        "error: this process may have 59 MB of address space (`ulimit -v`); nlosim needs 128 MB at "
        "the very least, and most scenarios 1 GB or more\n"
    )


@pytest.mark.slow
@LINUX
@pytest.mark.parametrize(
    ("deed", "code", "how"),
    [("os._exit(1)", 1, "exited with code 1"), ("os.abort()", -6, "was killed by SIGABRT")],
)
def test_a_library_that_ends_the_process_before_the_run_has_the_limit_named(
    tmp_path: Path, deed: str, code: int, how: str
) -> None:
    """BLAS and the Zenoh client do so where they get no memory."""
    (tmp_path / "parts.py").write_text(ENDING.format(deed=deed))
    (tmp_path / "ends.yaml").write_text(SCENARIO)
    done = limited_command("4000000", "run", "ends.yaml", "--json", cwd=tmp_path)
    error = json.loads(done.stdout)["error"]
    assert (done.returncode, error["kind"]) == (2, "memory")
    assert error["message"] == f"the process {how} before there was a run"
    assert error["address_space"] == 4_000_000 * 1024
    assert f"{how} before there was a run\nnote: this process may have 3906 MB" in done.stderr
    free = limited_command("unlimited", "run", "ends.yaml", cwd=tmp_path)
    assert free.returncode == code


@pytest.mark.slow
@LINUX
@pytest.mark.parametrize("kilobytes", ["300000", "700000"])
@pytest.mark.parametrize("transport", ["", "local", "zenoh"])
def test_too_little_for_a_scenario_is_no_crash_without_a_word(
    tmp_path: Path, kilobytes: str, transport: str
) -> None:
    options = ["--transport", transport] if transport else []
    given = ["run", "red_light", "--set", "time.stop=0.1s", "--out", "run", *options]
    done = limited_command(kilobytes, *given, cwd=tmp_path)
    assert done.returncode in {2, 3}
    note = f"note: this process may have {int(kilobytes) / 1024:.0f} MB of address space"
    assert done.stderr.splitlines()[-1].startswith(note)
    assert "bug" not in done.stderr
