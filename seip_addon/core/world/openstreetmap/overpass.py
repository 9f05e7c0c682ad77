"""Download of extracts of OpenStreetMap from an Overpass server, with a cache by place and day."""

import gzip
import math
import os
import re
import ssl
import sys
import threading
import zlib
from collections.abc import Generator
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from email.utils import parsedate_to_datetime
from http.client import HTTPException, HTTPResponse
from pathlib import Path
from urllib.error import HTTPError, URLError
from urllib.parse import quote, urlencode, urlsplit
from urllib.request import Request, build_opener

from ...base.errors import SeipError
from ...base.progress import REPORT_INTERVAL, Progress, in_thread
from ...site.sources import one_line
from ...storage.files import whole_file
from .extract import window

OVERPASS = "https://overpass-api.de/api/interpreter"
MAX_REACH = 3_000.0  # metres from a place to the edge of its area: a city has a million elements in 36 km²
MAX_SIZE = 200_000_000  # bytes of an answer, unpacked
KEPT_DAYS = 30  # after which a download is deleted, since nobody else does
MAX_WAIT = 300.0  # seconds that a busy server is waited for at most
EXPORT = "or export the area from openstreetmap.org and name that file"

_STEP = 50  # metres: areas are downloaded in sizes that are multiples of this
_ROUNDING = 1.0  # metres by which the middle of a downloaded area is rounded, at most
_QUERY_SECONDS = 90  # time that the server may work on a query
_QUERY_MEMORY = 1 << 28  # bytes that the server may use for it
_CHUNK = 1 << 16  # bytes that are received at once
_BLOCK = 1 << 20  # bytes that are packed at once
_SHOWN = 120  # characters of a server's message in ours
_AGENT = "SEIP-for-Blender (roadside LiDAR placement)"  # the rules of public servers ask programs for their name
_PACKED = 31  # of zlib: a gzip header and trailer
_BUSY = {429, 502, 503, 504}
_REMARK = re.compile(rb"<remark>(.*?)</remark>", re.DOTALL)
_PAGE_FAULT = re.compile(rb"</strong>\s*:(.*?)</p>", re.DOTALL)  # of Overpass's own pages about an error
_SLOT = re.compile(rb"\bin (-?\d+) seconds")
_PAGE = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:<\?xml[^>]*>)?\s*(?:<!doctype html|<html)", re.IGNORECASE)
_NAME = re.compile(r"(-?\d+\.\d{5})_(-?\d+\.\d{5})_(\d+)m_(\d{4}-\d\d-\d\d)\.osm\.gz")
_CUT_OFF = f"the answer of {{host}} is cut off: try again, name a different Overpass server, {EXPORT}"
_UNREACHABLE = (
    "{host} cannot be reached ({text}): check the connection to the internet and the address of the Overpass server, "
    + EXPORT
)
_FAULTS: tuple[tuple[type[Exception] | tuple[type[Exception], ...], str], ...] = (
    (
        TimeoutError,
        "{host} has sent nothing for {seconds:g} s: try again later, name a different Overpass server, " + EXPORT,
    ),
    (
        ssl.SSLError,
        "the connection to {host} is not secure ({text}): a proxy may be in between; sign in to the network in your "
        "browser, install the certificate of the proxy, " + EXPORT,
    ),
    ((EOFError, HTTPException, zlib.error, ConnectionResetError, ConnectionAbortedError), _CUT_OFF),
)
"""Messages about connections that fail, by the kind of error."""


@dataclass(frozen=True)
class OverpassServer:
    """An Overpass server, and how downloads from it are made.

    Parameters
    ----------
    folder : Path
        Folder in which downloads are cached.
    address : str
        Address of the server's interpreter, or of the server alone.
    obstacle : str
        Reason why nothing may be downloaded, or "". Cached downloads are used nevertheless.
    timeout : float, seconds
        Longest time without data from the server.
    pause : float, seconds
        Waiting time before the next attempt if a busy server does not name one.
    attempts : int
        Largest number of attempts while the server is busy.
    """

    folder: Path
    address: str = OVERPASS
    obstacle: str = ""
    timeout: float = _QUERY_SECONDS + 30.0
    pause: float = 15.0
    attempts: int = 4

    @property
    def interpreter(self) -> str:
        """Address to which queries are sent.

        Raises
        ------
        SeipError
            The address is not one of the web.
        """
        try:
            parts = urlsplit(self.address.strip())
            valid = parts.scheme in {"http", "https"} and bool(parts.hostname) and parts.port != 0
            valid = valid and not re.search(r"[\s@]", parts.netloc)
        except ValueError:
            valid = False
        if not valid:
            raise SeipError(f"{self.address!r} is not the address of an Overpass server: give one like {OVERPASS}")
        path = parts.path.rstrip("/") or urlsplit(OVERPASS).path
        return f"{parts.scheme}://{parts.netloc}{quote(path, safe='/%')}"

    @property
    def name(self) -> str:
        """Name of the server's host."""
        return urlsplit(self.interpreter).hostname or ""


@dataclass(frozen=True)
class _Area:
    """Square that was downloaded: its middle in degrees, half its side in metres, and the day."""

    latitude: float
    longitude: float
    reach: int
    day: str

    @classmethod
    def around(cls, near: tuple[float, float], reach: float, day: str) -> "_Area":
        return cls(round(near[0], 5), round(near[1], 5), _STEP * math.ceil((reach + _ROUNDING) / _STEP), day)

    @classmethod
    def of(cls, path: Path) -> "_Area | None":
        """Return the area of a downloaded file by its name, None for other files."""
        found = _NAME.fullmatch(path.name)
        return None if found is None else cls(float(found[1]), float(found[2]), int(found[3]), found[4])

    @property
    def file_name(self) -> str:
        return f"{self.latitude:.5f}_{self.longitude:.5f}_{self.reach}m_{self.day}.osm.gz"

    @property
    def query(self) -> str:
        """Query for all elements in the area, and for the nodes outside of ways that reach into it.

        One union gives each element once. The usual ``out body; >; out skel;`` repeats nodes, without their tags.
        """
        south, west, north, east = window(self.latitude, self.longitude, self.reach)
        west, east = math.remainder(west, 360.0), math.remainder(east, 360.0)  # west > east across the date line
        box = f"({south:.6f},{west:.6f},{north:.6f},{east:.6f})"
        return (
            f"[out:xml][timeout:{_QUERY_SECONDS}][maxsize:{_QUERY_MEMORY}];"
            f"(node{box};relation{box};way{box};node(w););out body qt;"
        )

    def contains(self, near: tuple[float, float], reach: float) -> bool:
        """Return whether a square around a place lies in the area."""
        south, west, north, east = window(self.latitude, self.longitude, self.reach)
        longitude = self.longitude + math.remainder(near[1] - self.longitude, 360.0)
        least = window(near[0], longitude, reach)
        return south <= least[0] and west <= least[1] and least[2] <= north and least[3] <= east


class _BusyError(Exception):
    """The server has no time now; with the seconds after which it may have, None if it does not tell."""

    def __init__(self, seconds: float | None = None) -> None:
        super().__init__()
        self.seconds = seconds


def user_cache() -> Path:
    """Return the folder for downloads in the user's cache folder; it may not exist."""
    if sys.platform == "win32":
        parent = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        parent = Path.home() / "Library" / "Caches"
    else:
        parent = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return parent / "seip" / "openstreetmap"


def is_outgrown(path: Path, near: tuple[float, float], reach: float) -> bool:
    """Return whether a download was deleted or does not contain a whole place; false for all other files."""
    area = _Area.of(path)
    return area is not None and not (path.is_file() and area.contains(near, reach))


def download_extract(
    near: tuple[float, float], reach: float, server: OverpassServer, day: str = ""
) -> Generator[Progress, None, Path]:
    """Return an extract around a place: a cached one of the day, or a new one from a server.

    Parameters
    ----------
    near : (latitude, longitude), degrees
        Middle of the area.
    reach : float, metres
        Distance from there to each edge of the area.
    day : str
        Day of the cached extract (ISO 8601); by default today in UTC.

    Yields
    ------
    Progress
        Ten times a second. Closing the generator ends the download, and leaves no file.

    Raises
    ------
    SeipError
        The area is too large or empty, the server cannot be reached or stays busy, or its answer is not an extract.
    """
    day = day or datetime.now(UTC).date().isoformat()
    for path in sorted(server.folder.glob("*.osm.gz")):
        area = _Area.of(path)
        if area is not None and area.day == day and area.contains(near, reach):
            return path
    if server.obstacle:
        raise SeipError(server.obstacle)
    place = f"{near[0]:.5f}, {near[1]:.5f}"
    if reach > MAX_REACH:
        raise SeipError(
            f"the site needs {reach:,.0f} m of OpenStreetMap around {place}, more than the {MAX_REACH:,.0f} m that are "
            f"downloaded: choose a smaller radius, {EXPORT}"
        )
    area = _Area.around(near, reach, day)
    content = yield from _answer(area.query, server)
    if b'k="highway"' not in content:
        raise SeipError(
            f"OpenStreetMap has no streets within {reach:,.0f} m of {place}: give a place near a street, the latitude "
            "before the longitude"
        )
    path = server.folder / area.file_name
    with whole_file(path) as temporary, gzip.open(temporary, "wb", compresslevel=6) as file:
        for start in range(0, len(content), _BLOCK):
            yield Progress(start, len(content), "saving the extract")
            file.write(content[start : start + _BLOCK])
    _delete_old(server.folder, day)
    return path


def _delete_old(folder: Path, day: str) -> None:
    oldest = (date.fromisoformat(day) - timedelta(KEPT_DAYS)).isoformat()
    for path in folder.glob("*.osm.gz"):
        area = _Area.of(path)
        if area is not None and area.day < oldest:
            path.unlink(missing_ok=True)


def _answer(query: str, server: OverpassServer) -> Generator[Progress, None, bytes]:
    """Return the answer to a query; a busy server is asked again after the time that it names."""
    address = f"{server.interpreter}?{urlencode({'data': query})}"
    for attempt in range(1, server.attempts + 1):
        try:
            content = yield from _received(address, server)
            _check(content, server)
        except _BusyError as busy:
            named = busy.seconds
        else:
            return content
        seconds = (yield from _free_slot(server)) if named is None else named
        if attempt == server.attempts or seconds > MAX_WAIT:
            break
        yield from _waiting(seconds, server)
    later = f" for the next {seconds:,.0f} s" if seconds > MAX_WAIT else ""
    raise SeipError(f"{server.name} is busy{later}: try again later, name a different Overpass server, {EXPORT}")


def _waiting(seconds: float, server: OverpassServer) -> Generator[Progress, None, None]:
    """Wait, in steps that can be ended."""
    steps = math.ceil(seconds / REPORT_INTERVAL)
    pause = threading.Event()
    for step in range(steps):
        yield Progress(step, steps, f"{server.name} is busy, the next attempt is in {seconds:.0f} s")
        pause.wait(REPORT_INTERVAL)


def _free_slot(server: OverpassServer) -> Generator[Progress, None, float]:
    """Return the seconds until a server takes the next query from this machine, from its page of status."""
    address = f"{server.interpreter.rpartition('/')[0]}/status"
    try:
        page = yield from _received(address, server)
    except (SeipError, _BusyError):  # not every server has such a page
        return server.pause
    seconds = [] if b"available now" in page else [float(one) for one in _SLOT.findall(page)]
    return max(1.0, min(seconds)) if seconds else server.pause


def _received(address: str, server: OverpassServer) -> Generator[Progress, None, bytes]:
    """Return the content at an address, which is received in a thread so that it can be given up at any moment."""
    transfer = _Transfer(server)
    return (yield from in_thread(lambda stop: transfer.run(address, stop), transfer.progress))


class _Transfer:
    """Transfer of an answer, and its progress."""

    def __init__(self, server: OverpassServer) -> None:
        self._server = server
        self._received = self._total = 0

    def progress(self) -> Progress:
        """Return the share that was received, of answers whose length is known."""
        if not self._received:
            return Progress(0, 0, f"waiting for {self._server.name}")
        size = f"{self._received / 1e6:.1f} MB"
        return Progress(min(self._received, self._total), self._total, f"downloading from {self._server.name}, {size}")

    def run(self, address: str, stop: threading.Event) -> bytes:
        """Return the content at an address; something of it once it is not needed any more."""
        headers = {"User-Agent": _AGENT, "Accept-Encoding": "gzip"}
        request = Request(address, headers=headers)  # noqa: S310  # http or https: see `interpreter`
        try:
            # An opener of our own: the shared one keeps the proxies that the environment named at its first use.
            with build_opener().open(request, timeout=self._server.timeout) as response:
                self._total = response.length or 0
                return self._content(response, stop)
        except HTTPError as error:
            with error:
                raise _refusal(error, self._server) from error
        except (OSError, HTTPException, zlib.error, EOFError, ValueError) as error:  # ValueError: no name of a host
            raise _fault(error, self._server) from error

    def _content(self, response: HTTPResponse, stop: threading.Event) -> bytes:
        packed = response.headers.get("Content-Encoding", "").strip().lower() == "gzip"
        unpack = zlib.decompressobj(_PACKED) if packed else None
        content = bytearray()
        while not stop.is_set() and (chunk := response.read1(_CHUNK)):
            self._received += len(chunk)
            content += chunk if unpack is None else unpack.decompress(chunk)
            if len(content) > MAX_SIZE:
                raise SeipError(
                    f"{self._server.name} sends more than {MAX_SIZE / 1e6:,.0f} MB for the area: choose a smaller "
                    f"radius, {EXPORT}"
                )
        if not stop.is_set() and (self._received < self._total or (unpack is not None and not unpack.eof)):
            raise EOFError
        return bytes(content)


def _check(content: bytes, server: OverpassServer) -> None:
    """Raise an error unless content is a whole answer to a query."""
    is_page = _PAGE.match(content) is not None
    found = (_PAGE_FAULT if is_page else _REMARK).search(content)
    text = _plain(found[1]) if found else ""
    if "out of memory" in text:
        raise SeipError(f"the area has too much data for {server.name} ({text}): choose a smaller radius, {EXPORT}")
    if any(word in text for word in ("timed out", "timeout", "rate_limited")):
        raise _BusyError
    if "error" in text:
        raise SeipError(f"{server.name} cannot answer ({text}): name a different Overpass server, {EXPORT}")
    if is_page:
        raise _foreign_page(server)
    if b"<osm" not in content[:_CHUNK]:
        raise SeipError(
            f"the answer of {server.name} is not map data ({_plain(content[:_SHOWN])!r}): check the address of the "
            "Overpass server"
        )
    if not content[-_SHOWN:].rstrip().endswith(b"</osm>"):
        raise SeipError(_CUT_OFF.format(host=server.name))


def _refusal(error: HTTPError, server: OverpassServer) -> SeipError | _BusyError:
    """Return the error for an answer with another status than success."""
    try:
        page = error.read(_CHUNK)
    except (OSError, HTTPException):
        page = b""
    if error.code in _BUSY:
        return _BusyError(_seconds_after(error.headers.get("Retry-After", "")))
    if error.code == 407:
        return _proxy(f"{error.code} {error.reason}", server)
    if error.code == 511:
        return _foreign_page(server)
    if error.code == 413:
        return SeipError(f"the area is too large for {server.name}: choose a smaller radius, {EXPORT}")
    found = _PAGE_FAULT.search(page)
    reason = _plain(found[1]) if found else one_line(str(error.reason))[:_SHOWN]
    return SeipError(
        f"{server.name} refuses the query ({error.code} {reason}): check the address of the Overpass server, name a "
        f"different one, {EXPORT}"
    )


def _fault(error: Exception, server: OverpassServer) -> SeipError:
    """Return the error for a connection that failed."""
    reason = error.reason if isinstance(error, URLError) else error
    text = one_line(getattr(reason, "strerror", None) or str(reason))[:_SHOWN]
    if "Tunnel connection failed" in text:
        return _proxy(text, server)
    message = next((message for kinds, message in _FAULTS if isinstance(reason, kinds)), _UNREACHABLE)
    return SeipError(message.format(host=server.name, text=text, seconds=server.timeout))


def _proxy(reason: str, server: OverpassServer) -> SeipError:
    return SeipError(
        f"a proxy refuses the connection to {server.name} ({reason}): name one with its user and password in the "
        f"environment variable https_proxy, {EXPORT}"
    )


def _foreign_page(server: OverpassServer) -> SeipError:
    return SeipError(
        f"{server.name} answers with a web page in place of map data: sign in to the network in your browser, or check "
        "the address of the Overpass server"
    )


def _seconds_after(text: str) -> float | None:
    """Return the seconds that a ``Retry-After`` names, as a number or a date (RFC 9110)."""
    if text.strip().isdecimal():
        return float(text)
    try:
        time = parsedate_to_datetime(text)
    except ValueError:
        return None
    return max(0.0, (time.replace(tzinfo=time.tzinfo or UTC) - datetime.now(UTC)).total_seconds())


def _plain(text: bytes) -> str:
    """Return the beginning of a server's text for a message, on one line and without tags."""
    return one_line(re.sub(r"<[^>]*>", " ", text.decode("utf-8", errors="replace")))[:_SHOWN]
