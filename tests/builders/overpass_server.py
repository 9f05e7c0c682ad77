"""An Overpass server on the loopback address: it gives the answers of a script, in order, and notes what was asked."""

import gzip
import threading
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs, urlsplit

DATE = "2026-11-27"
PAGE = """<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE html PUBLIC "-//W3C//DTD XHTML 1.0 Strict//EN" "http://www.w3.org/TR/xhtml1/DTD/xhtml1-strict.dtd">
<html xmlns="http://www.w3.org/1999/xhtml" xml:lang="en" lang="en">
<head><title>OSM3S Response</title></head>
<body>
<p>The data included in this document is from www.openstreetmap.org. The data is made available under ODbL.</p>
<p><strong style="color:#FF0000">Error</strong>: {} </p>
</body>
</html>
"""
RATE_LIMIT = PAGE.format(
    "runtime error: open64: 0 Success /osm3s_osm_base Dispatcher_Client::request_read_and_idx::rate_limited. "
    "Please check /api/status for the quota of your IP address."
)
TOO_BUSY = PAGE.format(
    "runtime error: open64: 0 Success /osm3s_osm_base Dispatcher_Client::request_read_and_idx::timeout. "
    "The server is probably too busy to handle your request."
)
STATUS = """Connected as: 2130706433
Current time: 2026-11-28T10:00:00Z
Rate limit: 2
Slot available after: 2026-11-28T10:00:48Z, in 48 seconds.
Slot available after: 2026-11-28T10:00:12Z, in 12 seconds.
Currently running queries (pid, space limit, time limit, start time):
"""
OUT_OF_TIME = 'runtime error: Query timed out in "query" at line 1 after 91 seconds.'
OUT_OF_MEMORY = 'runtime error: Query run out of memory in "recurse" at line 1 using about 256 MB of RAM.'


def overpass_xml(extract, remark=""):
    """Return an extract as Overpass writes it: with a credit, the date of the data, and a remark at its end."""
    start, end = '<osm version="0.6">', "</osm>"
    head = (
        '<osm version="0.6" generator="Overpass API 0.7.62.8">\n<note>The data included in this document is from '
        f'www.openstreetmap.org. The data is made available under ODbL.</note>\n<meta osm_base="{DATE}T09:31:06Z"/>\n'
    )
    tail = f"\n<remark> {remark} </remark>\n" if remark else "\n"
    text = extract.text()
    assert start in text
    return text.replace(start, head).replace(end, f"{tail}{end}\n")


@dataclass
class Answer:
    """Answer of the server.

    Parameters
    ----------
    text : str or bytes
    status : int
    headers : dict
    packed : bool
        Whether the text is packed with gzip.
    sent : int or None
        Number of bytes that are sent before the connection ends, all without a number.
    held : Event or None
        The answer stops after these bytes until the event is set.
    """

    text: str | bytes
    status: int = 200
    headers: dict[str, str] = field(default_factory=dict)
    packed: bool = False
    sent: int | None = None
    held: threading.Event | None = None

    def content(self):
        raw = self.text.encode() if isinstance(self.text, str) else self.text
        return gzip.compress(raw) if self.packed else raw


class OverpassStandIn:
    """What the server answers, and what it was asked.

    Parameters
    ----------
    answers : list of Answer
        Answers to queries, in order.
    status : str
        Page of status, "" for none.
    """

    def __init__(self, port):
        self.address = f"http://127.0.0.1:{port}/api/interpreter"
        self.port, self.answers, self.status = port, [], ""
        self.queries, self.agents, self.paths = [], [], []


@contextmanager
def overpass_server():
    """Run a server while the block runs."""
    with ThreadingHTTPServer(("127.0.0.1", 0), _Handler) as server:
        server.daemon_threads = True
        server.block_on_close = False
        server.stand_in = stand_in = OverpassStandIn(server.server_port)
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
        thread.start()
        try:
            yield stand_in
        finally:
            for answer in stand_in.answers:
                if answer.held is not None:
                    answer.held.set()
            server.shutdown()
            thread.join()


class _Handler(BaseHTTPRequestHandler):
    def do_GET(self):  # as the library calls it
        stand_in, parts = self.server.stand_in, urlsplit(self.path)
        stand_in.paths.append(parts.path)
        if parts.path == "/api/status":
            self._send(Answer(stand_in.status) if stand_in.status else Answer("none", 404))
            return
        stand_in.queries.append(parse_qs(parts.query).get("data", [""])[0])
        stand_in.agents.append(self.headers.get("User-Agent", ""))
        self._send(stand_in.answers[len(stand_in.queries) - 1])

    def do_CONNECT(self):  # as above
        self._send(self.server.stand_in.answers[0])

    def _send(self, answer):
        content = answer.content()
        self.send_response(answer.status)
        packing = {"Content-Encoding": "gzip"} if answer.packed else {}
        for name, value in ({"Content-Length": str(len(content))} | packing | answer.headers).items():
            if value:
                self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content[: answer.sent])
        self.wfile.flush()
        if answer.held is not None:
            answer.held.wait(20.0)
        self.close_connection = True

    def log_message(self, *_):
        """Write nothing."""
