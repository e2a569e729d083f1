"""Largest errors of the channel's formulas against data from Veins; see golden/README.md."""

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .primitives import Body, PathLoss, Primitives, Ring


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Cases compared and the largest absolute error [dB or 1]."""

    cases: int
    error: float


def _comparison(ours: list[float], theirs: list[float]) -> Comparison:
    errors = np.abs(np.array(ours) - np.array(theirs))
    return Comparison(cases=len(errors), error=float(errors.max()))


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def path_loss(primitives: Primitives, folder: Path, model: str) -> Comparison:
    """One of the models of the file: `simple`, `tworay` or `breakpoint`."""
    rows = [row for row in _rows(folder / "pathloss.csv") if row["model"] == model]
    tx, rx = ([[float(row[f"{end}_{k}"]) for k in "xyz"] for row in rows] for end in ("tx", "rx"))
    frequency = [float(row["freq_hz"]) for row in rows]
    loss = primitives.path_loss(tx, rx, frequency, [_path_loss_model(row) for row in rows])
    return _comparison(list(loss), [float(row["loss_db"]) for row in rows])


def _path_loss_model(row: dict[str, str]) -> PathLoss:
    if row["model"] == "simple":
        return PathLoss(exponent=float(row["alpha"]), lossless_distance=1.0)
    if row["model"] == "tworay":
        return PathLoss(model="two_ray", permittivity=float(row["epsilon_r"]))
    return PathLoss(
        model="breakpoint",
        exponent=float(row["alpha1"]),
        lossless_distance=1.0,
        breakpoint_distance=float(row["breakpoint_m"]),
        breakpoint_near_loss=float(row["L01_db"]),
        breakpoint_far_loss=float(row["L02_db"]),
        breakpoint_far_exponent=float(row["alpha2"]),
    )


def antenna_gain(primitives: Primitives, folder: Path) -> Comparison:
    """Sampled patterns of 4 to 72 azimuths."""
    ours: list[float] = []
    cases = json.loads((folder / "antenna_gain.json").read_text())
    for case in cases:
        x, y = np.subtract(case["other"], case["own"])
        azimuth = np.arctan2(y, x) - np.arctan2(case["orientation"][1], case["orientation"][0])
        ours.append(primitives.pattern_gain(case["gains_db"], float(azimuth)))
    return _comparison(ours, [case["gain_db"] for case in cases])


def building_shadowing(primitives: Primitives, folder: Path, category: str) -> Comparison:
    """Links through buildings of one category; infinitely high as in Veins."""
    ours: list[float] = []
    theirs: list[float] = []
    for scene in json.loads((folder / "building_shadowing.json").read_text()):
        if scene["category"] != category:
            continue
        queries = [query for query in scene["queries"] if query["status"] == "ok"]
        ours += _building_losses(primitives, scene["obstacles"], queries)
        theirs += [query["loss_db"] for query in queries]
    return _comparison(ours, theirs)


def _building_losses(
    primitives: Primitives, obstacles: list[dict[str, Any]], queries: list[dict[str, Any]]
) -> list[float]:
    kinds = sorted({(o["db_per_cut"], o["db_per_meter"]) for o in obstacles})
    loss = np.zeros(len(queries))
    tx, rx = [query["tx"] for query in queries], [query["rx"] for query in queries]
    for kind in kinds if queries else ():
        rings = [
            Ring(corners=o["shape"])
            for o in obstacles
            if (o["db_per_cut"], o["db_per_meter"]) == kind
        ]
        walls, indoors = primitives.penetration(rings, tx, rx)
        loss += walls * kind[0] + indoors * kind[1]
    return list(loss)


def vehicle_shadowing(primitives: Primitives, folder: Path) -> Comparison:
    """Links over vehicles, by Veins' conventions (edge at the face nearest to the sender)."""
    ours: list[float] = []
    theirs: list[float] = []
    for scene in json.loads((folder / "vehicle_shadowing.json").read_text()):
        vehicles, queries = scene["vehicles"], scene["queries"]
        owner = {vehicle["antenna_id"]: k for k, vehicle in enumerate(vehicles)}
        loss, _ = primitives.shadow(
            [_body(vehicle) for vehicle in vehicles],
            [query["tx"] for query in queries],
            [query["rx"] for query in queries],
            own=[
                (owner.get(query["tx_antenna_id"], -1), owner.get(query["rx_antenna_id"], -1))
                for query in queries
            ],
            frequency=[query["freq_hz"] for query in queries],
            reciprocal=False,
        )
        ours += list(loss)
        theirs += [query["loss_db"] for query in queries]
    return _comparison(ours, theirs)


def _body(vehicle: dict[str, float]) -> Body:
    """Veins places a vehicle by a point `host_offset` behind its front bumper."""
    ahead = vehicle["host_offset"] - vehicle["length"] / 2
    heading = vehicle["heading_rad"]
    x, y = vehicle["x"] + ahead * np.cos(heading), vehicle["y"] + ahead * np.sin(heading)
    size = (vehicle["length"], vehicle["width"], vehicle["height"])
    return Body(center=(x, y, 0.0), heading=heading, size=size)


def knife_edges(primitives: Primitives, folder: Path) -> Comparison:
    """Profiles of up to twelve edges."""
    cases = json.loads((folder / "knife_edge_profile.json").read_text())
    ours = [primitives.profile_loss(case["profile"], case["freq_hz"]) for case in cases]
    return _comparison(ours, [case["loss_db"] for case in cases])


def error_rate(primitives: Primitives, folder: Path) -> Comparison:
    """Success probabilities of all eight modes."""
    rows = _rows(folder / "nist_error_rate.csv")
    ours: list[float] = []
    theirs: list[float] = []
    for bitrate in sorted({row["bitrate_bps"] for row in rows}):
        mode = [row for row in rows if row["bitrate_bps"] == bitrate]
        snr = [float(row["snr_db"]) for row in mode]
        chunk, header, payload = primitives.success(
            float(bitrate), snr, [float(row["mpdu_bits"]) for row in mode]
        )
        for name, probability in (
            ("chunk_success", chunk),
            ("header_success", header),
            ("payload_success", payload),
            ("packet_success", header * payload),
        ):
            ours += list(probability)
            theirs += [float(row[name]) for row in mode]
    return _comparison(ours, theirs)
