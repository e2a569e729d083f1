"""A process that threads of libraries may call ends before Python is taken apart."""

import os
import subprocess
import sys
import textwrap

LOUD = """
    import os, sys, types
    class Loud:
        def __del__(self, os=os):
            os.write(1, b"taken apart\\n")
    sys.modules["holder"] = holder = types.ModuleType("holder")
    holder.loud = Loud()
    del holder
"""


def ended(program: str) -> tuple[int, str]:
    """Exit code and standard output of a program with something that tells when it is freed."""
    words = [sys.executable, "-c", textwrap.dedent(LOUD) + textwrap.dedent(program)]
    # with the usual buffer, of which nothing may be lost
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    done = subprocess.run(
        words, capture_output=True, text=True, timeout=60, check=False, env=buffered
    )
    assert not done.stderr
    return done.returncode, done.stdout


PROGRAM = """
    import atexit, sys
    from orchestrator import leaving
    leaving.prepare()
    atexit.register(print, "put in order")
    {called}
    print("said")
    sys.exit({code})
"""


def test_all_that_is_registered_is_done_and_python_is_not_taken_apart() -> None:
    called = PROGRAM.format(called="leaving.called_from_outside()", code="leaving.ends_with(3)")
    assert ended(called) == (3, "said\nput in order\n")


def test_other_processes_end_as_ever() -> None:
    """Without such threads, and where the exit code is not known: the help ends so."""
    usual = (3, "said\nput in order\ntaken apart\n")
    assert ended(PROGRAM.format(called="", code="leaving.ends_with(3)")) == usual
    assert ended(PROGRAM.format(called="leaving.called_from_outside()", code="3")) == usual


def test_output_that_cannot_be_written_changes_no_exit_code() -> None:
    full = """
        import io, sys
        from orchestrator import leaving
        class Full(io.StringIO):
            def flush(self):
                raise OSError(28, "No space left on device")
        leaving.prepare()
        leaving.called_from_outside()
        sys.stdout = Full()
        sys.exit(leaving.ends_with(4))
    """
    assert ended(full) == (4, "")


def test_commands_end_so() -> None:
    command = """
        import sys
        from orchestrator import leaving
        from orchestrator.cli import main
        leaving.called_from_outside()
        sys.argv = ["nlosim", {words}]
        sys.exit(main())
    """
    code, text = ended(command.format(words='"scenarios"'))
    assert code == 0
    assert "red_light" in text
    assert "taken apart" not in text
    code, text = ended(command.format(words='"check", "missing.yaml", "--json"'))
    assert code == 2
    assert "taken apart" not in text


def test_hosts_of_components_end_so() -> None:
    host = """
        import sys
        from types import SimpleNamespace
        from orchestrator import leaving
        from orchestrator.remote import host_main
        channel = SimpleNamespace(
            memory=None, receive=lambda: b"", close=lambda: print("closed", flush=True)
        )
        host_main.guarded = lambda lifeline: None
        host_main._take_standard_input = lambda: 0
        host_main._read_line = lambda lifeline: '{"log_level": 20, "admits": []}'
        host_main._end_with_parent = lambda lifeline: None
        host_main._connect = lambda instructions: channel
        leaving.called_from_outside()
        sys.exit(host_main.main())
    """
    assert ended(host) == (0, "closed\n")
