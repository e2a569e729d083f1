"""`nlosim schema`."""

import json
from argparse import Namespace
from pathlib import Path

from orchestrator.cli.outcome import Outcome
from orchestrator.scenario.editor_schema import installed_schema


def execute(arguments: Namespace) -> Outcome:
    """Print the JSON Schema of scenario files for this installation, or write it to a file."""
    schema = installed_schema()
    text = json.dumps(schema, indent=2, ensure_ascii=False)
    if arguments.out is None:
        return Outcome(text=text, data=schema)
    path = Path(arguments.out)
    path.write_text(f"{text}\n", encoding="utf-8")
    line = f"# yaml-language-server: $schema={path.absolute()}"
    said = f"{path}; editors use it for a file that begins with\n{line}"
    return Outcome(text=said, data={"path": str(path)})
