"""The report command: from a scene that knows where on the Earth it is to a page that can be sent."""

import io
import json
from contextlib import redirect_stdout

from headless import place, report

import bpy
import pytest

from seip_addon.core.output.results.placement_record import load_placement
from seip_addon.scene import contract
from seip_addon.scene.blend_file import open_blend, save_blend

CREDIT = "© OpenStreetMap contributors (ODbL), data of 2024-03-22"
QUICK = ["--sensor", "type1", "--heights", "3.5", "--grid", "4", "--spacing", "16", "--no-render"]
RULES = ["--count", "2", "--forbid", "signal pole 1", "--min-distance", "5", "--weighted", "--installed-cost"]


@pytest.fixture(scope="module")
def folder(small_scene, tmp_path_factory):
    """The small junction in UTM zone 32, placed with rules and installed costs."""
    made = tmp_path_factory.mktemp("located")
    open_blend(small_scene)
    scene = bpy.context.scene
    scene[contract.GEO_REFERENCE] = "+proj=utm +zone=32 +datum=WGS84"
    scene[contract.ATTRIBUTION] = f"{CREDIT}\nSurveyors & Sons"
    scene[contract.ASSUMPTIONS] = "one lane is assumed in each direction of Mill Lane\n<b>no</b> bridges"
    scene[contract.HEADER_OFFSET] = [-4_500_000.0, 5_300_000.0, 0.0, 0.0]
    scene[contract.PLACES] = json.dumps([["Mill Lane", "POLYGON ((-36 -7, -7 -7, -7 7, -36 7, -36 -7))"]])
    save_blend(made / "located.blend")
    place.main([str(made / "located.blend"), "-o", str(made / "out"), *QUICK, *RULES])
    with redirect_stdout(io.StringIO()) as said:
        report.main([str(made / "out")])
    assert said.getvalue().split() == [str(made / "out" / "report.html"), str(made / "out" / "report.pdf")]
    return made / "out"


def test_a_report_is_written(folder):
    assert (folder / "report.pdf").is_file()
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Mill Lane" in page
    record = load_placement(folder / "placement.json")
    assert f"${record.price_usd:,.0f} installed (" in page
    assert all(sensor.location in page for sensor in record.sensors)
    assert all("behind the kerb" in sensor.location for sensor in record.sensors)
    assert "Price installed, $" in page
    assert [point.count for point in record.front] == [1, 2, 3, 4]


def test_everything_that_is_shared_names_the_sources(folder):
    assert load_placement(folder / "placement.json").site.attribution == (CREDIT, "Surveyors & Sons")
    assert (folder / "ATTRIBUTION.txt").read_text(encoding="utf-8") == f"{CREDIT}\nSurveyors & Sons\n"
    assert json.loads((folder / "placement.geojson").read_text(encoding="utf-8"))["attribution"][0] == CREDIT
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "One lane is assumed in each direction of Mill Lane." in page
    assert "&lt;b&gt;no&lt;/b&gt; bridges." in page
    assert "may be off by several metres" in page
    assert f"Map data: {CREDIT}." in page
    assert "Map data: Surveyors &amp; Sons." in page
    assert f"<description>{CREDIT}\nSurveyors &amp;amp; Sons" in (folder / "placement.kml").read_text(encoding="utf-8")
    chunk = (folder / "scene.glb").read_bytes()
    size = int.from_bytes(chunk[12:16], "little")
    assert json.loads(chunk[20 : 20 + size])["asset"]["copyright"] == f"{CREDIT}; Surveyors & Sons"


def test_the_record_and_the_maps_agree(folder):
    record = load_placement(folder / "placement.json")
    features = json.loads((folder / "placement.geojson").read_text(encoding="utf-8"))["features"]
    points = [one["geometry"]["coordinates"] for one in features if one["properties"]["kind"] == "sensor"]
    assert points == [[one.longitude_deg, one.latitude_deg, round(one.altitude_m, 3)] for one in record.sensors]
    assert (folder / "placement.kml").is_file()
    assert record.settings["installed_cost"]["new_post_usd"] > 0
    assert all(one.installation_usd > 0 for one in record.sensors)
    assert not any("not written" in note for note in record.notes)
