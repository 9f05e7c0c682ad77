"""Lanes of a street from its tags: their numbers, their widths, and where they lie across the line of the way."""

import itertools

from .extract import Tags
from .quantities import count, metres

MAX_LANES, MAX_STREET_WIDTH = 12, 60.0
LANE_WIDTHS = (2.25, 6.0)
"""Narrowest and widest lane (metres); lane widths from tags are clamped to this range."""
LANE_WIDTH, SHARED_LANE_WIDTH = 3.2, 3.5
"""Assumed widths (metres) of a lane, and of a single lane for both directions."""
CYCLE_LANE_WIDTH, SIDEWALK_WIDTH = 1.5, 2.5  # metres
CYCLE_LANES = {"lane", "track", "opposite_lane", "opposite_track"}
WIDE_CLASSES = {"motorway", "trunk"}
"""Streets whose one-way carriageways usually have two lanes."""
ONE_WAY = {"yes", "true", "1"}
DIRECTIONS = ("forward", "backward")
_AGAINST = ("oneway:bus", "oneway:psv", "oneway:taxi")
_BUSWAYS = ("busway", "busway:left", "busway:right", "busway:both")


def is_roundabout(tags: Tags) -> bool:
    """Return whether a way is part of a roundabout."""
    return tags.get("junction") in ("roundabout", "circular")


def is_one_way(tags: Tags) -> bool:
    """Return whether general traffic goes along a street in one direction only."""
    motorway = tags.get("highway", "").startswith("motorway")
    return tags.get("oneway", "yes" if motorway or is_roundabout(tags) else "no") in ONE_WAY


def has_contraflow(tags: Tags) -> bool:
    """Return whether a one-way street has a lane against its direction, as for buses."""
    if not is_one_way(tags):
        return False
    whole, backward = _count(tags, "lanes"), _count(tags, "lanes:backward")
    if backward and (_count(tags, "lanes:forward") or whole > backward):
        return True
    if any(_count(tags, f"lanes:{users}:backward") for users in ("bus", "psv")):
        return True
    if any(tags.get(key) == "opposite_lane" for key in _BUSWAYS):
        return True
    # Buses against a street with one lane in all share that lane.
    return whole != 1 and any(tags.get(key) == "no" for key in _AGAINST)


def shares_lane(tags: Tags) -> bool:
    """Return whether a two-way street has a single lane for both directions."""
    listed = max(_listed_lanes(tags, f":{way}") for way in DIRECTIONS)
    own = sum(_count(tags, f"lanes:{way}") for way in DIRECTIONS)
    return not is_one_way(tags) and _count(tags, "lanes") == 1 and own <= 1 and listed <= 1


def lane_counts(tags: Tags) -> dict[str, int]:
    """Return the number of lanes of a street in each direction: ``forward`` and, if there are any, ``backward``.

    A direction without a number has `usual_lanes`. A single lane for both directions counts once for each.
    """
    whole = _count(tags, "lanes")
    own = {way: _count(tags, f"lanes:{way}") or _listed_lanes(tags, f":{way}") for way in DIRECTIONS}
    if is_one_way(tags):
        listed = _listed_lanes(tags, "")
        if not has_contraflow(tags):
            return {"forward": whole or own["forward"] or own["backward"] or listed or usual_lanes(tags)}
        backward = own["backward"] or 1
        return {
            "forward": own["forward"] or max(whole - backward, 0) or listed or usual_lanes(tags),
            "backward": backward,
        }
    # ``lanes`` counts both directions. Where it contradicts the numbers by direction, or leaves a direction without a
    # lane, the larger total holds. An odd lane, and any lanes that no direction has, go to the forward direction.
    total = max(whole, sum(number or 1 for number in own.values()))
    backward = own["backward"] or (total - own["forward"] if own["forward"] else total // 2)
    return {"forward": total - backward, "backward": backward}


def usual_lanes(tags: Tags) -> int:
    """Return the assumed number of lanes in each direction of a street without a number of lanes in the map."""
    return 2 if is_one_way(tags) and tags.get("highway") in WIDE_CLASSES else 1


def has_lane_count(tags: Tags) -> bool:
    """Return whether the map gives the number of lanes of a street."""
    given = {way: _count(tags, f"lanes{way}") or _listed_lanes(tags, way) for way in ("", ":forward", ":backward")}
    if is_one_way(tags):
        return any(given.values())
    return _count(tags, "lanes") > 0 or (given[":forward"] > 0 and given[":backward"] > 0)


def implausible_lanes(tags: Tags) -> dict[str, str]:
    """Return the tags for a street's number of lanes whose values are not plausible."""
    keys = ("lanes", "lanes:forward", "lanes:backward")
    return {key: tags[key] for key in keys if key in tags and (count(tags[key], MAX_LANES) or 0.0) <= 0.0}


def has_widths(tags: Tags) -> bool:
    """Return whether the map gives the width of a street's lanes."""
    return all(_given_widths(tags, way, number) for way, number in lane_counts(tags).items())


def lane_widths(tags: Tags) -> dict[str, list[float]]:
    """Return the widths (metres) of the driving lanes of each direction, left to right in driving direction."""
    usual = SHARED_LANE_WIDTH / 2 if shares_lane(tags) else LANE_WIDTH
    return {way: _given_widths(tags, way, number) or [usual] * number for way, number in lane_counts(tags).items()}


def cycle_lane(tags: Tags, way: str, *, left_hand: bool) -> str | None:
    """Return the kind of cycle lane, ``lane`` or ``track``, next to the lanes of a direction; None without one."""
    side = "left" if (way == "forward") == left_hand else "right"
    kind = tags.get(f"cycleway:{side}", tags.get("cycleway:both"))
    if kind is None:
        kind = tags.get("cycleway", "no")
        # Without a side, the lane of a one-way street is on the near side, and one against its traffic on the far side.
        if is_one_way(tags) and kind.startswith("opposite") == (way == "forward"):
            return None
    if kind not in CYCLE_LANES:
        return None
    return "track" if "track" in kind else "lane"


def divider_offset(tags: Tags, *, left_hand: bool) -> float:
    """Return how far the line between the directions of a street lies to the right of the line of its way, metres.

    Of a one-way street this is the edge of its lanes on the inner side, where those of the other direction would begin.
    The line of a way is the middle of the carriageway, cycle lanes included, unless the tag ``placement`` names a lane.
    """
    widths = lane_widths(tags)
    forward, backward = widths["forward"], widths.get("backward", [])[::-1]
    left, right = (forward, backward) if left_hand else (backward, forward)
    edges = list(itertools.accumulate([*left, *right], initial=0.0))  # of the lanes, from the left of the way
    divider = edges[len(left)]
    sections = {"": edges, ":forward": edges[: len(left) + 1], ":backward": edges[len(left) :][::-1]}
    if not left_hand:
        sections[":forward"], sections[":backward"] = edges[len(left) :], edges[: len(left) + 1][::-1]
    for way, section in sections.items():
        line = _placed(tags.get(f"placement{way}", ""), section)
        if line is not None:
            return divider - line
    marked = {way: CYCLE_LANE_WIDTH * (cycle_lane(tags, way, left_hand=left_hand) == "lane") for way in DIRECTIONS}
    near, far = marked["forward"], marked["backward"]
    return divider - (edges[-1] + (far - near if left_hand else near - far)) / 2


def _placed(placement: str, edges: list[float]) -> float | None:
    """Return the position of a ``placement`` like ``right_of:2`` among the edges of lanes; None if it has none."""
    side, _, text = placement.partition(":")
    number = int(count(text, MAX_LANES) or 0)
    if not 0 < number < len(edges):
        return None
    left, right = edges[number - 1], edges[number]
    return {"left_of": left, "middle_of": (left + right) / 2, "right_of": right}.get(side)


def _count(tags: Tags, key: str) -> int:
    """Return a number of lanes, 0 without a plausible one."""
    return int(count(tags.get(key), MAX_LANES) or 0)


def _listed_lanes(tags: Tags, way: str) -> int:
    """Return the number of lanes in the ``turn:lanes`` list of a direction, 0 without a list."""
    listed = tags.get(f"turn:lanes{way}", "")
    number = listed.count("|") + 1
    return number if listed and number <= MAX_LANES else 0


def _given_widths(tags: Tags, way: str, lanes: int) -> list[float]:
    """Return the widths of the driving lanes of one direction, metres; an empty list if the map has none."""
    low, high = LANE_WIDTHS
    # A list for each lane counts only if it fits the number of lanes. Otherwise the width of the whole carriageway is
    # shared equally between the lanes of both directions, less the cycle lanes marked on it.
    whole = ("width:lanes",) if is_one_way(tags) and way == "forward" else ()
    for key in (f"width:lanes:{way}", *whole):
        given = [metres(one, MAX_STREET_WIDTH) for one in tags.get(key, "").split("|")]
        if len(given) == lanes and all(given):
            return [min(max(one, low), high) for one in given if one]
    width = metres(tags.get("width", tags.get("width:carriageway")), MAX_STREET_WIDTH)
    if width is None:
        return []
    if shares_lane(tags):
        return [min(max(width, low), high) / 2]
    marked = sum(cycle_lane(tags, one, left_hand=False) == "lane" for one in DIRECTIONS)
    each = (width - marked * CYCLE_LANE_WIDTH) / sum(lane_counts(tags).values())
    return [min(max(each, low), high)] * lanes
