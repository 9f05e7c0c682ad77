"""Small OpenDRIVE files as text, for the tests of the reader."""

from seip_addon.core.world.opendrive.lanes import lane_surfaces
from seip_addon.core.world.opendrive.read import read_map


def lane(number, width=3.5, kind="driving", inside="", level="false"):
    """One lane of constant width, or with its own records ``inside`` and width None."""
    own = "" if width is None else f'<width sOffset="0" a="{width}" b="0" c="0" d="0"/>'
    return f'<lane id="{number}" type="{kind}" level="{level}">{own}{inside}</lane>'


def section(*lanes, s=0.0):
    """A lane section of lanes made by `lane`, told apart by the sign of their id."""
    sides = {
        "left": [text for text in lanes if 'id="-' not in text],
        "right": [text for text in lanes if 'id="-' in text],
    }
    inner = "".join(f"<{side}>{''.join(texts)}</{side}>" for side, texts in sides.items() if texts)
    return f'<laneSection s="{s}">{inner}</laneSection>'


def geometry(shape="<line/>", length=100.0, s=0.0, x=0.0, y=0.0, hdg=0.0):
    # Plain floats: NumPy 2 writes its own scalars as "np.float64(…)".
    s, x, y, hdg, length = (float(number) for number in (s, x, y, hdg, length))
    return f'<geometry s="{s!r}" x="{x!r}" y="{y!r}" hdg="{hdg!r}" length="{length!r}">{shape}</geometry>'


def road(
    plan=None, sections=None, *, number="1", junction="-1", elevation="", lateral="", offset="", objects="", signals=""
):
    plan = plan or geometry()
    sections = section(lane(-1)) if sections is None else sections
    return (
        f'<road id="{number}" junction="{junction}"><planView>{plan}</planView>'
        f"<elevationProfile>{elevation}</elevationProfile><lateralProfile>{lateral}</lateralProfile>"
        f"<lanes>{offset}{sections}</lanes><objects>{objects}</objects><signals>{signals}</signals></road>"
    )


def document(*roads, header="<header/>", rest=""):
    return f"<OpenDRIVE>{header}{''.join(roads)}{rest}</OpenDRIVE>"


def read_text(folder, text, name="map.xodr"):
    """Write a document into a folder and read it as a map."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return read_map(path)


def map_lanes(road_map, **options):
    """All lanes of a map in the order of the file."""
    return tuple(lane for each in road_map.roads for lane in lane_surfaces(each, **options))
