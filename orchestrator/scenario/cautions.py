"""What a scenario chooses that biases its results, for the summary of a run."""

import json

from orchestrator.scenario.model import Scenario


def cautions(scenario: Scenario) -> tuple[str, ...]:
    """A sentence for each parameter that has a value of which its declaration warns."""
    return tuple(
        f"`{name}.{key}` is {json.dumps(value)}: {parameter.caution.meaning}"
        for name, use in scenario.components.items()
        for declared in (use.type.parameters,)
        for key, value in use.all_values().items()
        if (parameter := declared.get(key)) is not None
        and parameter.caution is not None
        and parameter.caution.value == value
        and isinstance(value, bool) == isinstance(parameter.caution.value, bool)
    )
