"""Files that are taken for scenarios and are none."""

from orchestrator.errors import Problem, ScenarioError
from orchestrator.scenario.document import Document


def is_experiment(document: Document) -> bool:
    """Whether this is an experiment: a scenario is named, and nothing is in it."""
    data = document.data
    if not isinstance(data, dict) or "scenario" not in data or "components" in data:
        return False
    return not {"factors", "metrics", "seeds"}.isdisjoint(data)


def refuse_experiment(document: Document) -> None:
    """Say of an experiment what it is, instead of all that it lacks to be a scenario.

    Raises:
        ScenarioError: it is one.
    """
    if is_experiment(document):
        what = (
            "this is an experiment, not a scenario; `nlosim experiment` runs it, and "
            "`nlosim check` checks it"
        )
        raise ScenarioError([Problem(document.key(("scenario",)), what)])
