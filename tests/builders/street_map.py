"""A street along x that crosses a junction, as OpenDRIVE text, for tests of what is built from maps."""

LANE = '<lane id="{id}" type="{kind}" level="false"><width sOffset="0" a="{width}" b="0" c="0" d="0"/>{height}</lane>'


def street_map(
    *, x=0.0, y=0.0, kerb=0.0, furniture="", signals="", lane_types=("driving", "sidewalk"), grade=0.0, rule="RHT"
):
    """Return a map: 100 m of street on each side of a junction of 20 m, two lanes of 3.5 m, pavements of 2 m.

    ``furniture`` and ``signals`` stand on the western road, which runs from (x - 110, y) to (x - 10, y).
    """
    roads = [
        _road("1", x - 110, y, 100, "-1", kerb, lane_types, grade, rule, furniture, signals),
        _road("2", x - 10, y, 20, "7", kerb, ("driving",), grade, rule),
        _road("3", x + 10, y, 100, "-1", kerb, lane_types, grade, rule),
    ]
    return (
        '<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="6" name="street">'
        "<geoReference>+proj=utm +zone=32</geoReference></header>"
        f'{"".join(roads)}<junction id="7" name="crossing"/></OpenDRIVE>'
    )


def _road(number, x, y, length, junction, kerb, lane_types, grade, rule, furniture="", signals=""):
    level = f'<height sOffset="0" inner="{kerb}" outer="{kerb}"/>' if kerb else ""
    widths = {"driving": 3.5}
    sides = {
        sign: "".join(
            LANE.format(
                id=sign * (i + 1), kind=kind, width=widths.get(kind, 2.0), height=level if kind == "sidewalk" else ""
            )
            for i, kind in enumerate(lane_types)
        )
        for sign in (1, -1)
    }
    return (
        f'<road id="{number}" length="{length}" junction="{junction}" rule="{rule}"><planView>'
        f'<geometry s="0" x="{x!r}" y="{y!r}" hdg="0" length="{length}"><line/></geometry></planView>'
        f'<elevationProfile><elevation s="0" a="{grade * (x + 110)}" b="{grade}" c="0" d="0"/></elevationProfile>'
        f'<lanes><laneSection s="0"><left>{sides[1]}</left><center><lane id="0" type="none"/></center>'
        f"<right>{sides[-1]}</right></laneSection></lanes>"
        f"<objects>{furniture}</objects><signals>{signals}</signals></road>"
    )
