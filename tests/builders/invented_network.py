"""Invented networks of sites, with streets, for outputs."""

from __future__ import annotations

import math

import numpy as np

from seip_addon.core.output.network.network_record import NetworkRecord, NetworkSensor, NetworkSite

TYPES = ("os1_128", "vlp32c")
NAMES = {"os1_128": "OS1-128", "vlp32c": "Product <VLP>"}
PRICES = (18_000.0, 11_500.0)
CREATED = "2026-01-02T03:04:05+00:00"


def make_site(number, draw, *, middle=(52.47, 13.44), spread=0.02, criterion="road", status="equipped", name=None):
    """Return a site of one to four sensors near a place."""
    latitude, longitude = (np.array(middle) + draw.normal(scale=(spread, 1.6 * spread))).tolist()
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
    return NetworkSite(
        name,
        f"sites/{number:03d}",
        latitude,
        longitude,
        weight,
        status,
        "",
        **figures,
        sensors=sensors,
    )


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


def make_streets(middle=(52.47, 13.44), reach=0.06):
    """Return a grid of wavy streets of three ranks about a place."""
    along = np.linspace(-reach, reach, 200)
    streets = []
    for number in range(-30, 31):
        across = number * reach / 30 + 0.0006 * np.sin(90 * along + number)
        rank = 2 if number % 10 == 0 else int(number % 4 == 0)
        streets.append((np.column_stack([along, across]) + middle, rank))
        streets.append((np.column_stack([across, along]) + middle, rank))
    return streets
