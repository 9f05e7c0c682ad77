"""The command as a user runs it."""

from headless import build_scene

import bpy
import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.scene import contract

MAP = """<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="6" name="street"/>
<road id="1" length="200" junction="-1"><planView>
<geometry s="0" x="1000" y="2000" hdg="0" length="200"><line/></geometry>
</planView><lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
<lane id="-1" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
<lane id="-2" type="sidewalk" level="false"><width sOffset="0" a="2" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes></road></OpenDRIVE>"""


@pytest.fixture
def road(tmp_path):
    path = tmp_path / "street.xodr"
    path.write_text(MAP, encoding="utf-8")
    return path


@pytest.fixture
def site(tmp_path, road):
    path = tmp_path / "site.toml"
    path.write_text(
        f'name = "Kerbside"\nmap = "{road.name}"\nnear = [1100, 2000]\nradius = 30\n'
        "[[tree]]\nposition = [1100, 2005]\n",
        encoding="utf-8",
    )
    return path


def opened(path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return bpy.context.scene


def test_a_site_file_alone_is_enough(site, tmp_path):
    build_scene.main([str(site), "-o", str(tmp_path / "site.blend")])
    scene = opened(tmp_path / "site.blend")
    assert scene[contract.TITLE] == "Kerbside"
    assert scene[contract.MAP] == "street.xodr"
    assert "Tree 1" in bpy.data.objects


def test_the_command_line_goes_before_the_site_file(site, road, tmp_path):
    arguments = [str(road), "--site", str(site), "--near", "1150", "2000", "-o", str(tmp_path / "site.blend")]
    build_scene.main(arguments)
    assert list(opened(tmp_path / "site.blend")[contract.ORIGIN]) == [1150, 2000, 0]


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["{road}", "-o", "{out}.blend"], "no place is named"),
        (["{road}", "--near", "1100", "2000", "--approaches", "50", "-o", "{out}.blend"], "those of a junction"),
        (["{road}", "--near", "1100", "2000", "--level", "9", "-o", "{out}.blend"], "no road '9' at this place"),
        (["{road}", "--near", "1100", "2000", "-o", "{out}.obj"], r"does not end in \.blend"),
        (["{site}", "--site", "{site}", "-o", "{out}.blend"], "leave out the other one"),
        (["{road}", "--near", "1100", "2000", "-o", "{road}/out.blend"], "cannot write"),
    ],
)
def test_mistakes_are_named(road, site, tmp_path, arguments, complaint):
    filled = [each.format(road=road, site=site, out=tmp_path / "out") for each in arguments]
    with pytest.raises(SeipError, match=complaint):
        build_scene.main(filled)
