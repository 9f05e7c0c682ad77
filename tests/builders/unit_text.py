"""Calibration files of a unit with four beams, in each format."""

import json
import math

ELEVATIONS = [15.0, 13.5, -1.25, -14.0]
OFFSETS = [1.5, -2.5, 0.0, 4.25]
"""Counter-clockwise."""


def ouster(elevations=ELEVATIONS, offsets=OFFSETS, product="OS-1-4", mode="1024x10", *, nested=True):
    """Return Ouster's metadata, which count azimuth clockwise."""
    beams = {"beam_altitude_angles": list(elevations), "beam_azimuth_angles": [-one for one in offsets]}
    layout = {"pixels_per_column": len(elevations), "columns_per_frame": 1024}
    if not nested:
        return beams | {"data_format": layout, "prod_line": product, "lidar_mode": mode}
    return {
        "beam_intrinsics": beams,
        "lidar_data_format": layout,
        "config_params": {"lidar_mode": mode},
        "sensor_info": {"prod_line": product},
    }


def xml(elevations=ELEVATIONS, offsets=OFFSETS, off=2):
    """Return Velodyne's XML, with lasers that are not enabled after the others."""
    lasers = [*zip(elevations, offsets, strict=True), *[(0.0, 0.0)] * off]
    px = "".join(
        f"<item><px><id_>{number}</id_><rotCorrection_>{offset}</rotCorrection_>"
        f"<vertCorrection_>{elevation}</vertCorrection_></px></item>"
        for number, (elevation, offset) in enumerate(lasers)
    )
    enabled = "".join(f"<item>{int(number < len(elevations))}</item>" for number in range(len(lasers)))
    return (
        '<?xml version="1.0" encoding="UTF-8" standalone="yes" ?>\n<!DOCTYPE boost_serialization>\n'
        f"<boost_serialization><DB><enabled_><count>{len(lasers)}</count>{enabled}</enabled_>"
        f"<points_><count>{len(lasers)}</count><item_version>1</item_version>{px}</points_></DB></boost_serialization>"
    )


def yaml(elevations=ELEVATIONS, offsets=OFFSETS, *, braces=True):
    """Return the YAML of Velodyne's driver: radians, in any order."""
    rows = reversed(list(enumerate(zip(elevations, offsets, strict=True))))
    values = [(number, math.radians(offset), math.radians(elevation)) for number, (elevation, offset) in rows]
    if braces:
        items = [
            "- {dist_correction: 0.0, two_pt_correction_available: true,\n"
            f"  laser_id: {number}, rot_correction: {turn},\n  vert_correction: {up}}}\n"
            for number, turn, up in values
        ]
    else:
        items = [
            f"  - dist_correction: 1.5e-1  # metres\n    laser_id: {number}\n    rot_correction: {turn}\n"
            f"    vert_correction: {up}\n"
            for number, turn, up in values
        ]
    return f"# of a unit\ndistance_resolution: 0.002\nlasers:\n{''.join(items)}num_lasers: {len(elevations)}\n"


def hesai(elevations=ELEVATIONS, offsets=OFFSETS, head="Laser id,Elevation,Azimuth"):
    """Return Hesai's table, with the digest that closes some."""
    rows = [f"{row + 1},{up},{-turn}" for row, (up, turn) in enumerate(zip(elevations, offsets, strict=True))]
    return "\n".join([head, *reversed(rows), "eab2786616959df9,,"])


def robosense(elevations=ELEVATIONS, offsets=OFFSETS):
    """Return RoboSense's table, with rings."""
    return "".join(f" {up},{-turn},{row}\t\n" for row, (up, turn) in enumerate(zip(elevations, offsets, strict=True)))


FILES = {
    "nested.json": json.dumps(ouster()),
    "flat.json": json.dumps(ouster(nested=False)),
    "old.json": json.dumps(ouster() | {"lidar_data_format": "error: Command not recognized."}),
    "db.xml": xml(),
    "braces.yaml": yaml(),
    "lines.yml": yaml(braces=False),
    "hesai.csv": hesai(),
    "robosense.csv": robosense(),
}
