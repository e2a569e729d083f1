"""The options with which SUMO is started."""

from adapters.sumo.parameters import TrafficParameters


def sumo_options(given: TrafficParameters, seed: int) -> dict[str, str]:
    """What SUMO is told by option, whatever the configuration says.

    Args:
        given: the parameters of the component.
        seed: of SUMO's random numbers unless the parameters have another one.
    """
    options = {
        "--configuration-file": str(given.scene),
        "--step-length": f"{given.step_length:.3f}",
        "--seed": str(seed if given.sumo_seed is None else given.sumo_seed),
        "--no-step-log": "true",
        "--no-warnings": "true",  # on standard error; see `WarningLog`
        "--duration-log.disable": "true",
        "--random": "false",  # it would overrule the seed
    }
    if given.scale is not None:
        options["--scale"] = f"{given.scale:.17g}"
    if given.entities:  # their bodies are checked here, exactly; SUMO must not act
        options["--collision.action"] = "none"
    if is_anybody_moved_here(given):
        options["--time-to-teleport"] = "-1"  # or SUMO lifts those off the road that stand
    return options


def is_anybody_moved_here(given: TrafficParameters) -> bool:
    """Whether SUMO does not move some entity, which it would lift off the road as it stands."""
    return any(entity is not None and entity.is_moved_here for entity in given.entities.values())
