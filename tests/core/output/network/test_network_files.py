"""Files of a network: same bytes, names that stay text, and figures that agree between the files."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from seip_addon.core.output.network.network_record import (
    SCHEMA,
    NetworkRecord,
    NetworkSensor,
    NetworkSite,
    gain_text,
    ranked_sites,
)
from seip_addon.core.output.network.write import make_network_report, write_network
from seip_addon.core.output.report.blocks import Facts
from seip_addon.core.storage.json_dataclass import from_json

TYPES = ("os1_128", "vlp32c")
NAMES = {"os1_128": "OS1-128", "vlp32c": "Product <VLP>"}
PRICES = (18_000.0, 11_500.0)
MIDDLE = (52.47, 13.44)
CREATED = "2026-01-02T03:04:05+00:00"


def make_site(number, draw, *, criterion="road", status="equipped", name=None):
    """Return a site of one to four sensors near a place."""
    latitude, longitude = (np.array(MIDDLE) + draw.normal(scale=(0.02, 0.032))).tolist()
    name = name or f"{draw.choice(['Mill', 'Harbour', 'Rope', 'Church'])} Lane / Street {number}"
    weight = float(draw.choice([1.0, 1.0, 2.0]))
    if status != "equipped":
        message = "its extract has no crossing of that name" if status == "failed" else ""
        return NetworkSite(name, f"sites/{number:03d}", latitude, longitude, weight, status, message)
    types = draw.integers(0, 2, int(draw.integers(1, 5))).tolist()
    sensors = tuple(
        NetworkSensor(
            f"S{at + 1}",
            TYPES[kind],
            *(latitude + 2e-4 * math.sin(at), longitude + 3e-4 * math.cos(at), 5.4, f"Pole {at}", PRICES[kind]),
        )
        for at, kind in enumerate(types)
    )
    price = sum(sensor.price_usd for sensor in sensors)
    coverage = float(1 - 0.55 ** len(types) * draw.uniform(0.6, 1.3))
    value = coverage if criterion == "road" else float(1.2 * coverage * len(types))
    figures = {"price_usd": price, "value": value, "bound": value * 1.01, "coverage": coverage}
    place = (name, f"sites/{number:03d}", latitude, longitude)
    return NetworkSite(*place, weight, status, "", **figures, sensors=sensors)


def make_network(count=25, *, criterion="road", statuses=("equipped",) * 5 + ("without sensor", "failed"), **changes):
    """Return a network whose sites take the statuses in turn."""
    draw = np.random.default_rng(7)
    sites = tuple(
        make_site(number, draw, criterion=criterion, status=statuses[number % len(statuses)]) for number in range(count)
    )
    return network_of(sites, criterion=criterion, **changes)


def network_of(sites, *, criterion="road", **changes):
    """Return the network of given sites."""
    usable = [site for site in sites if site.status != "failed"]
    total = sum(site.weight for site in usable) or 1.0
    value = sum(site.weight * site.value for site in usable) / total
    price = sum(site.price_usd for site in sites)
    content = {
        "name": "Invented town",
        "budget_usd": 1.02 * price + 1000.0,
        "attribution": ("© OpenStreetMap contributors (ODbL), data of 2024-03-22",),
        "notes": ("prices are those of sensors only",),
        "created": CREATED,
    }
    return NetworkRecord(
        **(content | {"criterion": criterion, "price_usd": price, "value": value, "bound": 1.02 * value} | changes),
        sites=sites,
        sensor_types=TYPES,
        sensor_names=NAMES,
    )


def make_streets(reach=0.06):
    """Return a grid of wavy streets of three ranks about a place."""
    along = np.linspace(-reach, reach, 200)
    streets = []
    for number in range(-30, 31):
        across = number * reach / 30 + 0.0006 * np.sin(90 * along + number)
        rank = 2 if number % 10 == 0 else int(number % 4 == 0)
        streets.append((np.column_stack([along, across]) + MIDDLE, rank))
        streets.append((np.column_stack([across, along]) + MIDDLE, rank))
    return streets


HOSTILE = ("<script>alert(1)</script>", "=cmd|' /C calc'!A0", "مفترق \u202eevil", "🚦 Ecke & “x” $a_b$", '" onload="x')


def hostile_network():
    draw = np.random.default_rng(3)
    sites = [make_site(number, draw, name=name) for number, name in enumerate(HOSTILE)]
    sites[0] = replace(sites[0], folder="javascript:alert(1)/<b>")
    sites[1] = replace(sites[1], folder="//elsewhere.example/x")
    failed = replace(make_site(9, draw, status="failed"), message="<i>no & road</i>")
    return network_of((*sites, failed), name=HOSTILE[0])


def facts(record):
    return dict(next(block for block in make_network_report(record, b"").first if isinstance(block, Facts)).rows)


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("criterion", ["road", "returns"])
def test_the_record_survives_its_file_and_the_same_record_gives_the_same_bytes(tmp_path, criterion):
    record = make_network(criterion=criterion)
    first, again = (write_network(tmp_path / name, record, make_streets()) for name in ("a", "b"))
    stored = json.loads((tmp_path / "a" / "network.json").read_text(encoding="utf-8"))
    assert stored["schema"] == SCHEMA
    assert from_json(NetworkRecord, stored) == record
    assert len(first) == 6
    for one, other in zip(first, again, strict=True):
        assert one.read_bytes() == other.read_bytes(), one.name
    assert b"(D:20260102030405Z)" in (tmp_path / "a" / "report.pdf").read_bytes()


def test_names_stay_text(tmp_path):
    record = hostile_network()
    write_network(tmp_path, record)
    report = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<script" not in report
    assert "<i>" not in report
    names = {row["name"] for row in rows_of(tmp_path / "sites.csv")}
    assert f"'{HOSTILE[1]}" in names
    assert not any(name.startswith("=") for name in names)
    properties = [one["properties"] for one in json.loads((tmp_path / "network.geojson").read_text())["features"]]
    assert set(HOSTILE) <= {one["name"] for one in properties if one["kind"] == "site"}


def test_people_read_products_and_programs_read_types(tmp_path):
    record = make_network()
    write_network(tmp_path, record)
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "× OS1-128" in text
    assert "Product &lt;VLP&gt;" in text
    assert "os1_128" not in text
    assert any("× os1_128" in row["types"] for row in rows_of(tmp_path / "sites.csv"))


def test_the_geojson_holds_every_site_and_sensor_where_the_record_has_them(tmp_path):
    record = make_network()
    write_network(tmp_path, record)
    text = (tmp_path / "network.geojson").read_text(encoding="utf-8")
    content = json.loads(text)
    assert content["attribution"] == list(record.attribution)
    points = shapely.get_coordinates(shapely.from_geojson(text))
    sites = [one for one in content["features"] if one["properties"]["kind"] == "site"]
    sensors = [sensor for site in record.sites for sensor in site.sensors]
    assert len(sites) == len(record.sites)
    assert len(points) == len(sites) + len(sensors)
    places = {one["properties"]["folder"]: one["geometry"]["coordinates"] for one in sites}
    for site in record.sites:
        assert places[site.folder] == pytest.approx((site.longitude, site.latitude), abs=1e-8)
    expected = sorted((sensor.longitude, sensor.latitude) for sensor in sensors)
    assert np.array(sorted(points[len(sites) :].tolist())) == pytest.approx(np.array(expected), abs=1e-8)


def test_sites_are_ranked_by_gain_per_dollar_with_their_weight():
    draw = np.random.default_rng(0)
    twins = [replace(make_site(number, draw), price_usd=20_000.0, value=0.5, weight=1.0) for number in range(3)]
    twins[1] = replace(twins[1], weight=4.0)
    free = replace(make_site(3, draw), price_usd=0.0, weight=2.0)
    failed, bare = (make_site(4 + at, draw, status=status) for at, status in enumerate(("failed", "without sensor")))
    record = network_of((failed, free, bare, *twins))
    ranked = ranked_sites(record)
    assert [site for site, _ in ranked] == [twins[1], twins[0], twins[2], free, bare, failed]
    mean = (2.0 + bare.weight + 1.0 + 4.0 + 1.0) / 5
    assert [gain for _, gain in ranked[:3]] == pytest.approx([0.1 / mean, 0.025 / mean, 0.025 / mean])
    assert [gain for _, gain in ranked[3:]] == [None, None, None]
    assert gain_text(record, 0.0251) == "2.51 points"
    assert gain_text(replace(record, criterion="returns"), math.log(1.25)) == "25.0%"


@pytest.mark.parametrize(("status", "sites"), [("without sensor", 5), ("failed", 0)])
def test_networks_without_sensors_are_written(tmp_path, status, sites):
    record = make_network(sites, statuses=(status,))
    assert all(path.stat().st_size for path in write_network(tmp_path, record))
    assert facts(record)["Sensors"] == "none"
    assert ("Proof" in facts(record)) == (status != "failed")


@pytest.mark.parametrize(
    ("criterion", "value", "bound", "words"),
    [
        ("road", 0.7, 0.7, "sees more of the road."),
        ("road", 0.7, 0.7121, "sees more than 71.3% of the road."),
        ("returns", math.log(16.0), math.log(17.31), "has more than 16.4 returns from a typical road user."),
    ],
)
def test_the_certificate_gives_the_bound_rounded_up(criterion, value, bound, words):
    record = make_network(2, criterion=criterion, value=value, bound=bound)
    assert (
        record.certificate
        == f"Proven: no other use of ${record.budget_usd:,.0f} among these sites and candidates {words}"
    )
    assert facts(record)["Proof"] == record.certificate
