"""The files that all experiments of the campaign make together.

collision.csv              per condition: collisions with intervals, and more
collision_claims.csv       the paper's claims and ours, with verdicts
collision_critical.csv     packet error rates at which the collision rate crosses 1, 10 and 50 %
collision_linearity.csv    how far the curves over constant rates are from straight lines
collision_assumption.csv   the simulated channel against a constant rate of the same mean
collision_partners.csv     with whom the ego collided
figure9_10.*               collision rate over packet error rate: points (CSV), picture (SVG, PNG)
collision_policies.svg     driving policies under perfect communication; and PNG
collision_radio.svg        weaker radios; and PNG
collision_load.svg         loads and loss granularities; and PNG
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from studies.collision import (
    assumption,
    claims,
    critical,
    figure_load,
    figure_per,
    figure_policies,
    figure_radio,
    linearity,
    partners,
    rates,
)
from studies.collision.campaign import (
    CONSTANT_PER,
    LOAD,
    POLICIES,
    RADIO,
    Campaign,
    beside_relay,
)
from studies.collision.curves import curves
from studies.method import csv_file

TABLE: Final = "collision"
CLAIMS: Final = "collision_claims"
CRITICAL: Final = "collision_critical"
LINEARITY: Final = "collision_linearity"
ASSUMPTION: Final = "collision_assumption"
PARTNERS: Final = "collision_partners"
FIGURE: Final = "figure9_10"

Rows = Sequence[Mapping[str, Any]]


def write(campaign: Campaign, folder: Path) -> None:
    """Write tables and figures of what there is; pictures of nothing are left out."""
    points = campaign.points
    table = rates.rows(points)
    on_curves = [point for each in curves(points).values() for point in each]
    over_per = rates.rows(on_curves)
    tables: dict[str, Rows] = {
        TABLE: table,
        CLAIMS: claims.rows(campaign),
        CRITICAL: critical.rows(points),
        LINEARITY: linearity.rows(points),
        ASSUMPTION: assumption.rows(points),
        PARTNERS: partners.rows(points),
        FIGURE: over_per,
    }
    for name, rows in tables.items():
        csv_file.write(folder / f"{name}.csv", rows)
    if over_per:
        figure_per.draw(over_per, folder / FIGURE)
    if rows := [row for row in table if row["experiment"] == POLICIES]:
        figure_policies.draw(rows, folder / POLICIES)
    if rows := beside_relay(table, RADIO):
        constant = [row for row in table if row["experiment"] == CONSTANT_PER]
        figure_radio.draw(rows, constant, folder / RADIO)
    if rows := beside_relay(table, LOAD):
        figure_load.draw(rows, folder / LOAD)
