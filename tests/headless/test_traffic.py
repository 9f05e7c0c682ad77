"""The command as a user runs it."""

import os
import subprocess
import sys
from pathlib import Path

from headless import traffic

import numpy as np
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.programs.sumo_programs import find_sumo
from seip_addon.core.sensing.traffic.trajectories import Trajectories
from tests.sumo_here import needs_sumo

ROOT = Path(__file__).resolve().parents[2]
JUNCTION = ROOT / "scenes" / "junction.blend"
TOWN = Path(os.environ.get("SEIP_MAPS", ROOT.parent / "shared" / "opendrive")) / "Town05.xodr"
PAPERS = TOWN.parent.parent / "traffic"


def fcd(folder, y=-5.25, angle=90.0, count=30):
    """A car that drives in at the west on the outer lane."""
    rows = "".join(
        f'<timestep time="{k / 5:.1f}"><vehicle id="west" x="{-100 + 2 * k}" y="{y}" angle="{angle}" type="t" '
        'lane="e_0" speed="10"/></timestep>'
        for k in range(count)
    )
    path = folder / "run.fcd.xml"
    path.write_text(f"<fcd-export>{rows}</fcd-export>", encoding="utf-8")
    return path


def routes(folder):
    path = folder / "run.rou.xml"
    path.write_text('<routes><vType id="t" length="4"/></routes>', encoding="utf-8")
    return path


def test_floating_car_data_is_put_on_the_road(tmp_path, capsys):
    output = tmp_path / "traffic.npz"
    sources = ["--fcd", str(fcd(tmp_path)), "--routes", str(routes(tmp_path))]
    traffic.main([str(JUNCTION), *sources, "-o", str(output)])
    said = capsys.readouterr().out
    assert "1 road user (1 car) from 0 to 5.8 s, 30 samples" in said
    assert "warning" not in said
    got = Trajectories.load(output)
    np.testing.assert_allclose(got.position[0, :2], [-102.0, -5.25])
    assert got.position[0, 2] == pytest.approx(0.015 * (102.0 - 35.0), abs=0.01)  # West Street climbs by 1.5 %
    assert (got.pitch < -0.01).any()
    assert got.source == "run.fcd.xml"


def test_a_span_of_time_is_cut_out_and_missing_sizes_are_said(tmp_path, capsys):
    output = tmp_path / "t.npz"
    traffic.main([str(JUNCTION), "--fcd", str(fcd(tmp_path)), "--start", "1", "--duration", "1", "-o", str(output)])
    assert Trajectories.load(output).span == (1.0, 2.0)
    assert "warning: missing sizes: 1 of 1 road user is of" in capsys.readouterr().out


def test_another_map_leaves_no_file(tmp_path):
    output = tmp_path / "t.npz"
    with pytest.raises(SeipError, match="FCD of another map"):
        traffic.main([str(JUNCTION), "--fcd", str(fcd(tmp_path, y=-40.0)), "-o", str(output)])
    with pytest.raises(SeipError, match=r"FCD of another map.*none of the 1 road users"):
        traffic.main([str(JUNCTION), "--fcd", str(fcd(tmp_path, y=-4000.0)), "-o", str(output)])
    assert not output.exists()


@pytest.mark.parametrize("given", [
    ["--simulate", "x.xodr", "--routes", "x.xml"], ["--simulate", "x.xodr", "--start", "1"],
    ["--fcd", "x.xml", "--flow", "9"], ["--fcd", "x.xml", "--seed", "1"],
])  # fmt: skip
def test_options_of_the_other_source_are_refused(given, tmp_path):
    with pytest.raises(SeipError, match=f"{given[2]} is for --"):
        traffic.main([str(JUNCTION), *given, "-o", str(tmp_path / "t.npz")])


@needs_sumo
def test_simulated_twice_it_is_the_same_file(tmp_path, capsys):
    names = [tmp_path / "one.npz", tmp_path / "two.npz"]
    for name in names:
        traffic.main([
            str(JUNCTION), "--simulate", str(JUNCTION.with_suffix(".xodr")), "--seed", "5", "--duration", "10",
            "--warm-up", "20", "-o", str(name),
        ])  # fmt: skip
    assert names[0].read_bytes() == names[1].read_bytes()
    assert Trajectories.load(names[0]).span == (0.0, 9.8)
    assert "FCD" not in capsys.readouterr().out


@pytest.mark.slow
@needs_sumo
@pytest.mark.skipif(not (TOWN.is_file() and PAPERS.is_dir()), reason="Town05 or its traffic is not there")
def test_the_paper_s_traffic_runs_on_the_road_of_town05(tmp_path, capsys):
    blend, data, output = tmp_path / "town05.blend", tmp_path / "run.fcd.xml.gz", tmp_path / "traffic.npz"
    subprocess.run(  # noqa: S603  # our own interpreter and command
        [sys.executable, "-m", "headless.build_scene", str(TOWN), "--near", "-49", "-1", "--radius", "40",
         "-o", str(blend)],
        cwd=ROOT, check=True, timeout=120, capture_output=True,
    )  # fmt: skip
    net, rou = PAPERS / "Town05.net.xml", PAPERS / "Town05.rou.xml"
    subprocess.run(  # noqa: S603  # SUMO's program and our arguments
        [find_sumo().sumo, "--net-file", net, "--route-files", rou, "--seed", "1", "--end", "60", "--step-length",
         "0.1", "--device.fcd.period", "0.2", "--fcd-output", data, "--precision", "3", "--no-step-log"],
        check=True, timeout=120, capture_output=True,
    )  # fmt: skip
    traffic.main([str(blend), "--fcd", str(data), "--routes", str(rou), "--net", str(net), "-o", str(output)])
    assert "warning" not in capsys.readouterr().out
    got = Trajectories.load(output)
    assert len(got) > 20
    assert {user.length for user in got.users} == {5.0}
    with pytest.raises(SeipError, match="FCD of another map"):  # without the network its offset is not known
        traffic.main([str(blend), "--fcd", str(data), "--routes", str(rou), "-o", str(output)])
