"""Traffic of the paper's case: whether its files are of the site, and whether its runs are independent."""

from headless.studies.paper.traffic_runs import (
    MOST_OVERLAP,
    TrafficSource,
    make_runs,
    overlaps,
    read_demand_of_site,
)

from seip_addon.core.base.progress import finish
from seip_addon.core.programs.sumo_programs import find_sumo, run
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from seip_addon.core.workflows.traffic_runs import runs_in
from tests.builders.plain_street import street
from tests.sumo_here import needs_sumo

FLOWS = '<routes><route id="WE" edges="w e"/><flow id="f" vehsPerHour="{}" route="WE"/>{}</routes>'


def network(y=0.0, joint=0.0):
    """Two streets along x at height y, which meet at x = joint, in the coordinates of an offset of (100, 50)."""

    def edge(name, begin, end):
        shape = f"{begin + 100},{y + 50} {end + 100},{y + 50}"
        return (
            f'<edge id="{name}" from="a" to="b"><lane id="{name}_0" index="0" disallow="pedestrian" '
            f'length="{end - begin}" shape="{shape}"/></edge>'
        )

    return f'<net><location netOffset="100,50"/>{edge("w", -300, joint)}{edge("e", joint, 300)}</net>'


def files(folder, net=None, flows=None):
    (folder / "a.net.xml").write_text(net or network(), encoding="utf-8")
    (folder / "a.rou.xml").write_text(flows or FLOWS.format(360, ""), encoding="utf-8")
    return TrafficSource(folder / "a.rou.xml", (), folder / "a.net.xml")


def test_demand_is_that_of_all_flows(tmp_path):
    more = '<flow id="g" vehsPerHour="90"><route edges="e"/></flow>'
    demand = finish(read_demand_of_site(files(tmp_path, flows=FLOWS.format(360, more)), street(), "a.xodr"))
    assert demand.rate == 450.0


NODES = '<nodes><node id="a" x="-300" y="0"/><node id="b" x="0" y="0"/><node id="c" x="300" y="0"/></nodes>'
EDGES = """<edges><edge id="w" from="a" to="b" numLanes="2" speed="14"/>
<edge id="e" from="b" to="c" numLanes="2" speed="14"/></edges>"""

STEADY = """<routes><vType id="t" speedDev="0" sigma="0"/>
<flow id="f" vehsPerHour="700" type="t"><route edges="w e"/></flow></routes>"""


@needs_sumo
def test_drawn_runs_are_independent_and_the_same_when_drawn_again(tmp_path):
    programs, net = find_sumo(), tmp_path / "made.net.xml"
    (tmp_path / "a.nod.xml").write_text(NODES, encoding="utf-8")
    (tmp_path / "a.edg.xml").write_text(EDGES, encoding="utf-8")
    given = ["--node-files", tmp_path / "a.nod.xml", "--edge-files", tmp_path / "a.edg.xml", "--output-file", net]
    finish(run(programs, programs.netconvert, [*given, "--offset.disable-normalization", "true"], "test"))
    source = files(tmp_path, net.read_text(encoding="utf-8"), STEADY)
    demand = finish(read_demand_of_site(source, street(), "a.xodr"))
    inputs = tmp_path / "site.blend", source, demand, street(), 4, 20.0
    drawn = finish(make_runs(*inputs))
    assert overlaps(drawn)[-1] <= MOST_OVERLAP
    assert len(overlaps(drawn)) == 6
    assert drawn == runs_in(tmp_path / "site_traffic")
    assert not list(tmp_path.glob("site_traffic*/*.xml"))
    assert all(Trajectories.load(path).span[1] <= 20.0 for path in drawn)
    before = [path.read_bytes() for path in drawn]
    assert [path.read_bytes() for path in finish(make_runs(*inputs))] == before
