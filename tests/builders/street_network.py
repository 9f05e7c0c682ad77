"""Street networks by hand, as netconvert writes them."""

from seip_addon.core.world.traffic_simulation.street_network import read_network

LANE = '<lane id="{edge}_{index}" index="{index}" {who} length="{length}" shape="0,0 {length},0"/>'
ROAD, PAVEMENT, BAYS = 'disallow="pedestrian"', 'allow="pedestrian"', 'allow="custom1"'


def edge(name, end, *lanes, length=120):
    parts = "".join(LANE.format(edge=name, index=index, who=who, length=length) for index, who in enumerate(lanes))
    return f'<edge id="{name}" from="x" to="{end}">{parts}</edge>'


def way(start, end, direction, lane=0):
    return f'<connection from="{start}" to="{end}" fromLane="{lane}" toLane="0" dir="{direction}"/>'


def network(folder, *elements):
    path = folder / "n.net.xml"
    path.write_text(f"<net>{''.join(elements)}</net>", encoding="utf-8")
    return read_network(path)


def three_ways(folder):
    """An arm `in` that leads left, on and right, each with a pavement."""
    return network(
        folder,
        '<edge id=":j_0" function="internal"><lane id=":j_0_0" index="0" length="5" shape="0,0 1,0"/></edge>',
        edge("in", "j", PAVEMENT, ROAD),
        *(edge(name, "out", PAVEMENT, ROAD, ROAD) for name in ("left", "on", "right")),
        '<junction id="j" type="traffic_light" x="3" y="4"/><junction id="out" type="dead_end" x="0" y="0"/>',
        *(way("in", name, direction, 1) for name, direction in (("left", "l"), ("on", "s"), ("right", "R"))),
        way("in", "in", "t", 1),
        way(":j_0", "on", "s"),
    )
