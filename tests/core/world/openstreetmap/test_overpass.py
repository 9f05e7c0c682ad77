"""Extracts from an Overpass server: downloads, their cache, and the errors of servers and networks."""

import re
import socket
import threading
import time
from pathlib import Path

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish, progress_line
from seip_addon.core.world.openstreetmap import overpass
from seip_addon.core.world.openstreetmap.extract import read_extract
from seip_addon.core.world.openstreetmap.overpass import OverpassServer, download_extract, is_outgrown, user_cache
from tests.builders.osm_text import Extract, crossing
from tests.builders.overpass_server import (
    DATE,
    OUT_OF_MEMORY,
    OUT_OF_TIME,
    PAGE,
    RATE_LIMIT,
    STATUS,
    TOO_BUSY,
    Answer,
    overpass_server,
    overpass_xml,
)

NEAR, REACH, DAY = (52.5, 13.4), 790.0, "2026-11-28"
PLACE = overpass_xml(crossing())
LOGIN = "<!DOCTYPE html><html><body><p><strong>Welcome</strong>: sign in to Hotel Wi-Fi</p></body></html>"


@pytest.fixture
def stand_in(monkeypatch):
    for name in ("http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY"):
        monkeypatch.delenv(name, raising=False)
    with overpass_server() as running:
        yield running


@pytest.fixture
def server(stand_in, tmp_path):
    return OverpassServer(tmp_path / "cache", stand_in.address, timeout=10.0, pause=0.0)


def download(server, near=NEAR, reach=REACH, day=DAY, report=None):
    return finish(download_extract(near, reach, server, day), report)


def files(server):
    return sorted(path.name for path in server.folder.iterdir()) if server.folder.exists() else []


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("length", [{}, {"Content-Length": ""}])
def test_download_is_an_extract_with_the_credit_and_date_of_its_data(stand_in, server, packed, length):
    stand_in.answers = [Answer(PLACE, packed=packed, headers=length)]
    path = download(server)
    assert files(server) == [path.name] == ["52.50000_13.40000_800m_2026-11-28.osm.gz"]
    extract = finish(read_extract(path))
    assert extract.attribution == f"© OpenStreetMap contributors (ODbL), data of {DATE}"
    assert not extract.notes
    assert {way.tags.get("name") for way in extract.ways.values()} >= {"East Road", "North Road"}
    assert stand_in.agents == [overpass._AGENT]  # noqa: SLF001  # servers ask for a name, no matter which


def test_query_asks_once_for_each_element_in_the_area(stand_in, server):
    stand_in.answers = [Answer(PLACE), Answer(PLACE)]
    download(server)
    (query,) = stand_in.queries
    box = r"\(([-\d.]+),([-\d.]+),([-\d.]+),([-\d.]+)\)"
    found = re.fullmatch(
        rf"\[out:xml\]\[timeout:\d+\]\[maxsize:\d+\];\(node{box};relation{box};way{box};node\(w\);\);out body qt;",
        query,
    )
    assert found[0].count(found[1]) == 3
    south, west, north, east = map(float, found.groups()[:4])
    assert (north - south) * 111_195 == pytest.approx(1600, rel=0.01)
    assert (east - west) * 111_195 * 0.6088 == pytest.approx(1600, rel=0.01)
    assert ((south + north) / 2, (west + east) / 2) == pytest.approx(NEAR, abs=1e-5)
    download(server, near=(-16.8, 179.999))
    _, west, _, east = map(float, re.search(box, stand_in.queries[1]).groups())
    assert -180.0 < east < -179.9 < 179.9 < west < 180.0


def test_cache_is_used_for_places_within_a_download_of_the_same_day(stand_in, server):
    stand_in.answers = [Answer(PLACE)] * 4
    first = download(server)
    assert download(server) == first
    assert download(server, near=(52.502, 13.403), reach=500.0) == first
    offline = OverpassServer(server.folder, "http://127.0.0.1:1", obstacle="Blender may not go online")
    assert download(offline) == first
    assert len(stand_in.queries) == 1
    others = [
        download(server, reach=850.0),
        download(server, near=(52.502, 13.403)),
        download(server, day="2026-11-29"),
    ]
    assert len({first, *others}) == 4 == len(stand_in.queries)
    with pytest.raises(SeipError, match=r"^Blender may not go online$"):
        download(offline, day="2026-11-30")


def test_downloads_are_deleted_after_a_month(stand_in, server):
    stand_in.answers = [Answer(PLACE)] * 3
    first, second, third = (download(server, day=day) for day in ("2026-10-29", "2026-10-30", "2026-11-29"))
    assert (first.exists(), second.exists(), third.exists()) == (False, True, True)


def test_download_is_outgrown_by_what_it_does_not_contain(stand_in, server, tmp_path):
    stand_in.answers = [Answer(PLACE)]
    path = download(server)
    assert not is_outgrown(path, NEAR, REACH)
    assert is_outgrown(path, NEAR, 900.0)
    assert is_outgrown(path, (52.6, 13.4), 100.0)
    path.unlink()
    assert is_outgrown(path, NEAR, REACH)
    assert not is_outgrown(tmp_path / "place.osm", NEAR, REACH)


def test_progress_names_the_server_and_the_size(stand_in, server):
    held = threading.Event()
    stand_in.answers = [Answer(PLACE, sent=len(PLACE) // 2, held=held)]
    steps = download_extract(NEAR, REACH, server, DAY)
    seen = [next(steps)]
    while not seen[-1].done:
        seen.append(next(steps))
    steps.close()
    assert progress_line(seen[-1]) == "downloading from 127.0.0.1, 0.0 MB: 50% done"
    assert not files(server)


BUSY = [
    Answer(RATE_LIMIT, 429),
    Answer(TOO_BUSY, 504),
    Answer("", 503, {"Retry-After": "0"}),
    Answer(RATE_LIMIT),
    Answer(overpass_xml(Extract(), OUT_OF_TIME)),
    Answer(overpass_xml(crossing(), "runtime error: Dispatcher_Client::request_read_and_idx::rate_limited.")),
]


@pytest.mark.parametrize("busy", BUSY)
def test_busy_server_is_asked_again(stand_in, server, busy):
    stand_in.answers = [busy, Answer(PLACE)]
    assert download(server).is_file()
    assert len(stand_in.queries) == 2


def test_server_that_stays_busy_is_given_up(stand_in, server):
    stand_in.answers = [BUSY[0]] * 4
    with pytest.raises(SeipError, match=r"^127.0.0.1 is busy: try again later, name a different Overpass server, or"):
        download(server)
    assert len(stand_in.queries) == 4
    assert not files(server)


def after(seconds):
    return time.strftime("%a, %d %b %Y %H:%M:%S GMT", time.gmtime(time.time() + seconds))


@pytest.mark.parametrize(("headers", "status", "seconds"), [
    ({"Retry-After": "120"}, STATUS, 120),
    ({"Retry-After": 90}, "", 90),  # as a date, which is written when the test runs
    ({"Retry-After": "soon"}, "", 15),
    ({}, STATUS, 12),
    ({}, STATUS.replace("Rate limit: 2\n", "Rate limit: 3\n1 slots available now.\n"), 15),
])  # fmt: skip
def test_waiting_takes_the_time_that_the_server_names_and_ends_at_once(stand_in, tmp_path, headers, status, seconds):
    headers = {key: after(value) if isinstance(value, int) else value for key, value in headers.items()}
    stand_in.answers, stand_in.status = [Answer(RATE_LIMIT, 429, headers)], status
    server = OverpassServer(tmp_path / "cache", stand_in.address)
    steps = download_extract(NEAR, REACH, server, DAY)
    waiting = next(step for step in steps if "is busy" in step.what)
    assert waiting.total / 10 == pytest.approx(seconds, abs=2)
    assert re.search(r"the next attempt is in (\d+) s$", waiting.what)[1] in {f"{seconds - i}" for i in (0, 1, 2)}
    assert next(steps).done == waiting.done + 1
    start = time.monotonic()
    steps.close()
    assert time.monotonic() - start < 1.0
    assert len(stand_in.queries) == 1


def test_server_that_names_a_long_time_is_not_waited_for(stand_in, server):
    stand_in.answers = [Answer(RATE_LIMIT, 429, {"Retry-After": "3600"})]
    with pytest.raises(SeipError, match=r"is busy for the next 3,600 s: try again later"):
        download(server)


CUT = "the answer of 127.0.0.1 is cut off: try again"


@pytest.mark.parametrize(("answer", "complaint"), [
    (Answer(LOGIN), "answers with a web page in place of map data: sign in to the network in your browser"),
    (Answer(LOGIN, 511), "answers with a web page in place of map data: sign in"),
    (Answer("proxy", 407), r"a proxy refuses the connection to 127.0.0.1 \(407 .*: name one with its user and"),
    (Answer(overpass_xml(Extract())), "no streets within 790 m of 52.50000, 13.40000: give a place near a street"),
    (Answer(overpass_xml(crossing(), OUT_OF_MEMORY)), r"too much data for 127.0.0.1 \(.*256 MB.*a smaller radius"),
    (Answer(overpass_xml(crossing(), "runtime error: open64: 2 No such file")), r"cannot answer \(runtime error: open"),
    (Answer("", 413), "the area is too large for 127.0.0.1: choose a smaller radius"),
    (Answer(PAGE.format("line 1: parse error: Unknown type"), 400), r"refuses the query \(400 line 1: parse error"),
    (Answer("gone", 404), r"refuses the query \(404 Not Found\): check the address of the Overpass server"),
    (Answer('{"elements": []}'), "the answer of 127.0.0.1 is not map data"),
    (Answer(PLACE[:-200]), CUT),
    (Answer(PLACE, sent=500), CUT),
    (Answer(PLACE, packed=True, sent=500, headers={"Content-Length": ""}), CUT),
    (Answer(PLACE, headers={"Content-Encoding": "gzip"}), CUT),
    (Answer(f"1f4\r\n{PLACE[:300]}", headers={"Content-Length": "", "Transfer-Encoding": "chunked"}), CUT),
    (Answer("", 302, {"Location": "file:///etc/hostname"}), "refuses the query"),
])  # fmt: skip
def test_answers_that_are_no_extract_are_named_and_leave_no_file(stand_in, server, answer, complaint):
    stand_in.answers = [answer]
    with pytest.raises(SeipError, match=complaint):
        download(server)
    assert not files(server)


def test_answer_that_is_too_large_is_not_kept(stand_in, server, monkeypatch):
    monkeypatch.setattr(overpass, "MAX_SIZE", 1_000)
    stand_in.answers = [Answer(PLACE, packed=True)]
    with pytest.raises(SeipError, match="sends more than 0 MB for the area: choose a smaller radius"):
        download(server)
    assert not files(server)


def test_area_that_is_too_large_is_not_asked_for(stand_in, server):
    with pytest.raises(SeipError, match=r"needs 3,500 m of .*more than the 3,000 m .* choose a smaller radius"):
        download(server, reach=3_500.0)
    assert not stand_in.queries


def test_silent_server_is_given_up_after_the_timeout(stand_in, server):
    stand_in.answers = [Answer(PLACE, sent=400, held=threading.Event())]
    slow = OverpassServer(server.folder, server.address, timeout=0.2)
    with pytest.raises(SeipError, match=r"127.0.0.1 has sent nothing for 0.2 s: try again later"):
        download(slow)
    assert not files(server)


def test_download_ends_at_once_and_leaves_no_file(stand_in, server):
    stand_in.answers = [Answer(PLACE, sent=400, held=threading.Event())]
    start = time.monotonic()

    def interrupt(_progress):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        download(server, report=interrupt)
    assert time.monotonic() - start < 2.0
    assert not files(server)


def test_networks_without_the_server_are_named(stand_in, server, monkeypatch):
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        closed = OverpassServer(server.folder, f"http://127.0.0.1:{unused.getsockname()[1]}")
        with pytest.raises(SeipError, match=r"127.0.0.1 cannot be reached \(Connection refused\): check"):
            download(closed)
    with pytest.raises(SeipError, match=r"not secure \(.*a proxy may be in between"):
        download(OverpassServer(server.folder, stand_in.address.replace("http:", "https:"), timeout=2.0))

    def unknown(*_):
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    with pytest.raises(SeipError, match=r"overpass.invalid cannot be reached \(Name or service not known\): check"):
        download(OverpassServer(server.folder, "https://overpass.invalid/api/interpreter"))
    assert not files(server)


def test_proxy_that_asks_for_a_password_is_named(stand_in, server, monkeypatch):
    stand_in.answers = [Answer("", 407)]
    monkeypatch.setenv("https_proxy", f"http://127.0.0.1:{stand_in.port}")
    with pytest.raises(SeipError, match=r"a proxy refuses the connection to overpass.invalid \(Tunnel .*407"):
        download(OverpassServer(server.folder, "https://overpass.invalid/api/interpreter"))


@pytest.mark.parametrize("address", [
    "", "overpass-api.de", "ftp://host/x", "file:///etc/hostname", "http://", "http://a:b@host/", "http://a b/",
    "http://host:99999/", "http://[::1",
])  # fmt: skip
def test_address_that_is_none_is_named(server, address):
    with pytest.raises(SeipError, match="is not the address of an Overpass server: give one like https://"):
        download(OverpassServer(server.folder, address))


def test_address_of_a_server_gets_the_usual_path(stand_in, tmp_path):
    stand_in.answers = [Answer(PLACE)]
    download(OverpassServer(tmp_path, f"http://127.0.0.1:{stand_in.port}/"))
    assert stand_in.paths == ["/api/interpreter"]


@pytest.mark.parametrize(("platform", "variables", "folder"), [
    ("linux", {"XDG_CACHE_HOME": "/c"}, "/c/seip/openstreetmap"),
    ("linux", {"HOME": "/h"}, "/h/.cache/seip/openstreetmap"),
    ("darwin", {"HOME": "/h"}, "/h/Library/Caches/seip/openstreetmap"),
    ("win32", {"LOCALAPPDATA": "/l"}, "/l/seip/openstreetmap"),
])  # fmt: skip
def test_cache_is_in_the_user_s_folder_for_caches(monkeypatch, platform, variables, folder):
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(overpass.sys, "platform", platform)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert user_cache() == Path(folder)
