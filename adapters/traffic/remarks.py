"""Sentences about buildings and nets that every source of traffic says alike."""


def no_buildings(count: int, kind: str) -> str:
    """That `count` polygons of the type `kind`, which may be empty, are no buildings."""
    noun, verb = ("polygon", "is no building") if count == 1 else ("polygons", "are no buildings")
    named = f"of type `{kind}`" if kind else "without a type"
    return f"{count:,} {noun} {named} {verb}"


def no_heights(count: int, total: int, default: float) -> str:
    """That `count` of `total` buildings say no height and get the `default` [m]."""
    say, are = ("says", "is") if count == 1 else ("say", "are")
    return f"{count:,} of {total:,} buildings {say} no height and {are} taken as {default:g} m high"


def flat(low: float, high: float) -> str:
    """That heights of a net, from `low` to `high` [m], do not count."""
    return (
        f"the net says heights from {low:g} m to {high:g} m: the ground is taken as flat, so that "
        "roads above each other meet"
    )
