"""A process that has imported the foreign libraries, and forks one that runs pytest when asked to.

To import them takes longer than most tests. It reads a JSON object per line, with `words` of
pytest, `environment`, `folder` and `output`, and answers with the number of the process, and when
that has ended with its exit code. It is started by its path, with the names of these libraries, and
imports nothing of this project.
"""

import atexit
import importlib
import json
import os
import sys
import traceback
from contextlib import suppress


def main() -> None:
    """Answer until there is nothing more to read."""
    sys.path.pop(0)  # the folder of this file
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # libraries may greet
    for name in sys.argv[1:]:
        with suppress(ImportError):
            importlib.import_module(name)
    for line in sys.stdin:
        asked = json.loads(line)
        pid = os.fork()
        if pid == 0:
            _test(asked)
        print(pid, file=answers, flush=True)
        _, status = os.waitpid(pid, 0)
        print(os.waitstatus_to_exitcode(status), file=answers, flush=True)


def _test(asked: dict[str, object]) -> None:
    code = 70
    try:
        os.setsid()
        said = os.open(str(asked["output"]), os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        nothing = os.open(os.devnull, os.O_RDONLY)
        for old, new in ((nothing, 0), (said, 1), (said, 2)):
            os.dup2(old, new)
        os.environ.clear()
        os.environ.update(asked["environment"])  # type: ignore[call-overload]
        os.chdir(str(asked["folder"]))
        sys.path.insert(0, str(asked["folder"]))
        ready = ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # a plug-in is imported already
        sys.argv = ["pytest", *ready, *asked["words"]]  # type: ignore[misc]
        import pytest  # noqa: PLC0415 - it is imported already

        code = int(pytest.main(sys.argv[1:]))
        with suppress(BaseException):
            atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
    except BaseException:
        traceback.print_exc()  # to the one who asked
        raise
    finally:
        os._exit(code)


if __name__ == "__main__":
    main()
