"""``network.html``: sites of a network on a map and in a table, in one file without script that loads nothing."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from urllib.parse import quote

import numpy as np

from ...base.arrays import Integer
from ...base.counts import counted, round_number
from ..pictures.drawing import percent
from ..pictures.palette import INK, PAPER, PAPER_STREETS, SHARE_COLOURS, SOFT_INK
from ..report.html import page
from ..report.wording import dollars
from .network_map import BARE_RADIUS, NetworkView, Street, legend_money, network_view, radius_of
from .network_record import (
    NetworkRecord,
    NetworkSite,
    RankedSite,
    colour_title,
    gain_text,
    level,
    level_words,
    outcome,
    ranked_sites,
    result,
    sensors_text,
)

UNITS = 10_000  # of the map's width, so that whole numbers are fine enough
USUAL_WIDTH = 900  # pixels of the map that its marks are sized for
SHAPES = (0.5, 1.0)  # how many times as high as wide the map is

MAP_STYLE = f"""
#map {{ display: block; width: 100%; border: 1px solid #c9d1d7; box-sizing: border-box; }}
.street {{ fill: none; stroke-linecap: round; vector-effect: non-scaling-stroke; }}
.mark circle {{ stroke: {INK}; }}
.mark .hit {{ fill: transparent; stroke: none; }}
.mark .bare {{ fill: {PAPER}; stroke: {SOFT_INK}; }}
.mark text {{ font: 600 11px system-ui, sans-serif; text-anchor: middle; fill: {PAPER};
  stroke: {INK}; stroke-width: 2px; paint-order: stroke; }}
.cross {{ fill: none; stroke: {SOFT_INK}; stroke-width: 2; }}
.mark:hover circle, .mark:focus circle, .mark:target circle {{ stroke-width: 3; }}
.mark:focus {{ outline: none; }}
.mark:focus-visible .hit, .mark:target .hit {{ stroke: {INK}; stroke-width: 2; stroke-dasharray: 3 2; }}
tr:target {{ background: {PAPER_STREETS[0]}; }}
.under {{ display: flex; flex-wrap: wrap; justify-content: space-between; gap: .2em 1em; font-size: .85em;
  color: {SOFT_INK}; }}
.scale {{ border: 2px solid {INK}; border-top: 0; height: .35em; margin-top: .3em; }}
.scale + span {{ display: block; }}
.legend {{ display: flex; flex-wrap: wrap; gap: .2em 1.1em; align-items: center; padding: 0; margin: .4em 0;
  list-style: none; font-size: .9em; }}
.legend li {{ display: flex; align-items: center; gap: .35em; }}
.wide {{ overflow-x: auto; }}
tbody th {{ font-weight: 600; border-bottom-color: #dde3e7; min-width: 8em; overflow-wrap: anywhere; }}
td:last-child {{ white-space: nowrap; }}
a {{ color: inherit; }}
@media (max-width: 30em) {{ td.number {{ white-space: normal; }} }}
.skip:not(:focus) {{ position: absolute; left: -99em; }}
"""


def network_page(record: NetworkRecord, streets: Sequence[Street] | None = None) -> str:
    """Return the page; its links lead to the folders of the sites beside it."""
    view = network_view(record, streets, SHAPES)
    ranked = ranked_sites(record)
    equipped = sum(site.status == "equipped" for site in record.sites)
    summary = (
        f"{equipped:,} of {counted(len(record.sites), 'site has', 'sites have')} sensors for "
        f"{dollars(record.price_usd)} of {dollars(record.budget_usd)}. "
        f"{colour_title(record)}, mean of the sites: {outcome(record, record.value)}."
        if equipped
        else "No site has sensors."
    )
    length = round_number(view.width / 6)
    words = f"{length:g} m" if length < 1000 else f"{length / 1000:g} km"
    bar = f'<div class="scale" style="width: {100 * length / view.width:.3f}%"></div><span>{words}</span>'
    credits_ = "".join(f"<div>{escape(line)}</div>" for line in record.attribution)
    body = f"""<header>
<h1><bdi>{escape(record.name)}</bdi></h1>
<p class="subtitle">{escape(summary)}</p>
</header>
<main>
<a class="skip" href="#sites">Skip the map</a>
{_map(record, view, ranked)}
<div class="under"><div style="flex: 1 0 100%">{bar}</div><div>{credits_}</div></div>
{_legend(record, view)}
<h2 id="sites">Sites</h2>
<div class="wide">
{_table(record, ranked)}
</div>
</main>"""
    return page(record.name, body, MAP_STYLE)


def _map(record: NetworkRecord, view: NetworkView, ranked: tuple[RankedSite, ...]) -> str:
    left, _, _, top = view.window
    unit = UNITS / view.width
    parts = []
    for rank, colour in enumerate(PAPER_STREETS):
        lines = [np.rint((line - (left, top)) * (unit, -unit)).astype(int) for line, own in view.streets if own == rank]
        path = "".join(f"M{_pairs(line[:1])}l{_pairs(np.diff(line, axis=0))}" for line in lines)
        parts += [f'<path class="street" stroke="{colour}" stroke-width="{rank + 1}" d="{path}"/>'] if path else []
    at = {id(site): number for number, site in enumerate(record.sites)}
    for one in sorted(ranked, key=lambda one: -view.radii[at[id(one.site)]]):
        number = at[id(one.site)]
        x, y = np.rint((view.places[number] - (left, top)) * (unit, -unit)).astype(int).tolist()
        parts.append(_mark(record, one, (x, y), float(view.radii[number])))
    size = f"{UNITS} {UNITS * view.shape:.0f}"
    start = f'<svg id="map" role="group" aria-label="Map of the sites" viewBox="0 0 {size}">'
    return "\n".join((start, *parts, "</svg>"))


def _pairs(points: Integer) -> str:
    return " ".join(f"{x},{y}" for x, y in points.tolist()).replace(",-", "-")


def _mark(record: NetworkRecord, one: RankedSite, place: tuple[int, int], radius: float) -> str:
    site, (x, y) = one.site, place
    shape = '<path class="cross" d="M-5-5 5 5M-5 5 5-5"/>'
    if site.status == "equipped":
        colour = SHARE_COLOURS[level(record, site)]
        shape = f'<circle r="{radius:.1f}" fill="{colour}"/><text dy=".35em">{one.rank or ""}</text>'
    elif site.status == "without sensor":
        shape = f'<circle class="bare" r="{BARE_RADIUS}"/>'
    words = escape(f"{site.name}: {_described(record, site)}")
    start = f'<a class="mark" id="mark-{one.number}" href="#site-{one.number}" aria-label="{words}"'
    moved = f'transform="translate({x} {y}) scale({UNITS / USUAL_WIDTH:.1f})"'
    return f'{start} {moved}><title>{words}</title>{shape}<circle class="hit" r="{max(10.0, radius + 4):.1f}"/></a>'


def _described(record: NetworkRecord, site: NetworkSite) -> str:
    if site.status == "failed":
        return f"failed, {site.message}"
    if site.status == "without sensor":
        return site.status
    seen = f"{percent(site.coverage)} of the road seen"
    typical = "" if record.criterion == "road" else f"{outcome(record, site.value)} typical returns, "
    return f"{sensors_text(site.sensors, record.sensor_names)}, {dollars(site.price_usd)}, {typical}{seen}"


def _legend(record: NetworkRecord, view: NetworkView) -> str:
    entries = [f"<li>{colour_title(record)}:</li>"]
    for colour, words in zip(SHARE_COLOURS, level_words(record), strict=True):
        entries.append(_entry(f'<circle r="7" fill="{colour}" stroke="{INK}"/>', 8.0, words))
    money = legend_money(record)
    entries += ["<li>Money spent:</li>"] if money else []
    for amount in money:
        radius = radius_of(record, view, amount)
        entries.append(_entry(f'<circle r="{radius:.1f}" fill="none" stroke="{INK}"/>', radius + 1, dollars(amount)))
    bare = f'<circle r="{BARE_RADIUS}" fill="{PAPER}" stroke="{SOFT_INK}"/>'
    marks = {"without sensor": bare, "failed": '<path class="cross" d="M-5-5 5 5M-5 5 5-5"/>'}
    found = {site.status for site in record.sites}
    entries += [_entry(mark, 7.0, status) for status, mark in marks.items() if status in found]
    return f'<ul class="legend" aria-label="Legend">{"".join(entries)}</ul>'


def _entry(shape: str, half: float, words: str) -> str:
    box = f'viewBox="{-half:.1f} {-half:.1f} {2 * half:.1f} {2 * half:.1f}" width="{2 * half:.0f}" aria-hidden="true"'
    return f"<li><svg {box}>{shape}</svg>{escape(words)}</li>"


def _table(record: NetworkRecord, ranked: tuple[RankedSite, ...]) -> str:
    result = "Road seen" if record.criterion == "road" else "Returns"
    numbers = "".join(f'<th scope="col" class="number">{name}</th>' for name in (result, "Gain per $1,000", "Money"))
    names = ('<th scope="col" class="number">Rank</th><th scope="col">Site</th>', numbers)
    heads = "".join((*names, '<th scope="col">Sensors</th><th scope="col">Files</th>'))
    rows = "\n".join(_row(record, one) for one in ranked)
    return f"<table>\n<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}\n</tbody>\n</table>"


def _row(record: NetworkRecord, one: RankedSite) -> str:
    site = one.site
    equipped = site.status == "equipped"
    known = (result(record, site), gain_text(record, one.gain), dollars(site.price_usd))
    figures = known if equipped else ("–", "–", "–")
    cells = "".join(f'<td class="number">{words}</td>' for words in figures)
    sensors = sensors_text(site.sensors, record.sensor_names) if equipped else _described(record, site)
    place = "./" + quote(site.folder, safe="/")
    files = ", ".join(
        f'<a href="{escape(f"{place}/{file}")}">{word}</a>'
        for word, file in (("plan", "plan.png"), ("data", "placement.json"))
    )
    name = f'<th scope="row"><a href="#mark-{one.number}"><bdi>{escape(site.name)}</bdi></a></th>'
    start = f'<tr id="site-{one.number}"><td class="number">{one.rank or "–"}</td>{name}'
    return f"{start}{cells}<td>{escape(sensors)}</td><td>{files if equipped else ''}</td></tr>"
