"""What is saved opens again, and looks right at once."""

import bpy
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.scene.blend_file import CLIP_END, CLIP_START, new_file, open_blend, save_blend


def test_a_saved_scene_opens_again_and_leaves_no_other_file(tmp_path):
    new_file()["seip_origin"] = [1.0, 2.0, 3.0]
    save_blend(tmp_path / "deeper" / "site.blend")
    assert [path.name for path in (tmp_path / "deeper").iterdir()] == ["site.blend"]
    new_file()
    open_blend(tmp_path / "deeper" / "site.blend")
    assert list(bpy.context.scene["seip_origin"]) == [1, 2, 3]


def test_views_show_a_whole_site_through_its_camera(tmp_path):
    scene = new_file()
    scene.camera = bpy.data.objects.new("Overview", bpy.data.cameras.new("Overview"))
    scene.collection.objects.link(scene.camera)
    save_blend(tmp_path / "site.blend")
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "site.blend"), load_ui=True)
    views = [area.spaces.active for screen in bpy.data.screens for area in screen.areas if area.type == "VIEW_3D"]
    assert views
    for view in views:
        assert (view.clip_start, view.clip_end) == (CLIP_START, CLIP_END)
        assert (view.shading.color_type, view.region_3d.view_perspective) == ("MATERIAL", "CAMERA")


def test_a_name_that_is_none_of_a_blend_is_refused(tmp_path):
    with pytest.raises(SeipError, match=r"let it end in \.blend"):
        save_blend(tmp_path / "site.txt")


@pytest.mark.parametrize("content", [None, b"", b"no blend"])
def test_what_is_no_blend_is_refused_by_name(tmp_path, content):
    path = tmp_path / "site.blend"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(SeipError, match=r"site\.blend"):
        open_blend(path)
