"""The command on the paper's case, on a map and traffic of the tests' own."""

import re
from pathlib import Path

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.studies.paper import command as paper_case

from matplotlib.image import imread

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.programs.sumo_programs import find_sumo
from seip_addon.core.world.traffic_simulation.simulation import SignalPlan, _network
from seip_addon.core.world.traffic_simulation.street_network import read_network
from tests.sumo_here import needs_sumo

MAP = Path(__file__).resolve().parents[3] / "scenes" / "junction.xodr"
ROUTES = '<routes><route id="r" edges="{}"/><flow id="f" vehsPerHour="900" route="r"/></routes>'
ELSEWHERE = """<net><location netOffset="0,0"/>
<edge id="w" from="a" to="b"><lane id="w_0" index="0" length="9" shape="9000,0 9009,0"/></edge></net>"""


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    path = tmp_path_factory.mktemp("network") / "a.net.xml"
    finish(_network(find_sumo(), MAP, path, SignalPlan(), None))
    return path


@pytest.fixture
def run(tmp_path):
    def run(*options, junction="100", net=ELSEWHERE, edges="w", source=MAP):
        (tmp_path / "a.rou.xml").write_text(ROUTES.format(edges), encoding="utf-8")
        (tmp_path / "a.net.xml").write_text(net, encoding="utf-8")
        files = ["--routes", str(tmp_path / "a.rou.xml"), "--network", str(tmp_path / "a.net.xml")]
        folders = ["--work", str(tmp_path / "work"), "-o", str(tmp_path / "docs")]
        paper_case.main([str(source), "--junction", junction, *files, *folders, *options])

    return run


@needs_sumo
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"junction": "965"}, r"no junction '965' in map"),
        ({}, r"a.net.xml is not a network of the map junction.xodr at this site \(none of its streets is there\)"),
        ({"net": "<net/>"}, r"a.net.xml is not a SUMO network"),
        ({"source": MAP.with_name("none.xodr")}, r"there is no file .*none.xodr: check its path"),
    ],
)
def test_files_that_do_not_fit_are_one_sentence(run, tmp_path, changes, message):
    with pytest.raises(SeipError, match=message):
        run(**changes)
    assert not (tmp_path / "docs" / "paper.md").exists()
    assert not list(tmp_path.glob("work/*traffic*/*"))


@needs_sumo
@pytest.mark.slow
def test_the_page_is_written_with_its_charts(run, network, tmp_path, capsys):
    streets = read_network(network)
    arm = streets.arms[0]
    way = f"{arm.id} {streets.turns[arm.id][0][0]}"
    brief = ["--runs", "4", "--duration", "12", "--every", "9", "--steps", "1", "--trainings", "1"]
    few = ["--approaches", "20", "--effort", "2"]
    run(*brief, *few, net=network.read_text(encoding="utf-8"), edges=way)
    text = (tmp_path / "docs" / "paper.md").read_text(encoding="utf-8")
    assert "--steps 1 --trainings 1 --every 9" in text
    assert str(tmp_path) not in text
    assert "validation AP was still rising" in text
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert len(pictures) == 1
    assert all(imread(tmp_path / "docs" / picture).shape[1] > 600 for picture in pictures)
    said = capsys.readouterr().out
    assert "claim 8 (" in said
    assert "undecided" in text
