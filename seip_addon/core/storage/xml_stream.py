"""Streaming reader of untrusted XML files, which may be larger than memory."""

import gzip
import os
import zlib
from collections.abc import Callable, Generator
from pathlib import Path
from xml.parsers import expat  # document types, through which XML does harm, are refused below

from ..base.errors import SeipError
from ..base.progress import Progress

Attributes = dict[str, str]

SUMO_CURE = "let SUMO finish writing it"
_MAX_QUOTED = 60  # characters of a file in a message at most
_CHUNK = 1 << 20
_MAX_TOKEN = 8 << 20  # bytes of one tag, comment or text: expat scans an unfinished one again with each chunk
_MAX_DEPTH = 1000  # nested elements: maps and simulations have a dozen, and each level costs memory
_MAX_RATIO = 200  # ratio of unpacked to packed bytes; DEFLATE reaches 1,032 on content without information
_ALWAYS_UNPACKED = 1 << 30  # unpacked bytes accepted for any file: stationary traffic compresses very well, too
_GZIP = b"\x1f\x8b"


def read_tags(
    path: str | os.PathLike[str],
    take: Callable[[str, Attributes], object],
    leave: Callable[[str], object] | None = None,
    *,
    cure: str = SUMO_CURE,
) -> Generator[Progress, None, None]:
    """Call ``take`` with the name and the attributes of each element in a file, in order; it may be packed with gzip.

    Parameters
    ----------
    leave : callable, optional
        Called with the name of each element at its end.
    cure : str
        What to do if the XML is broken, for messages.

    Yields
    ------
    Progress
        After each mebibyte.

    Raises
    ------
    SeipError
        The file cannot be read, is not well-formed XML, or declares a document type: none is needed, and through one a
        file can read other files or exhaust memory.
    """
    name = Path(path).name
    parser = _parser(name, take, leave, cure)
    taken = 0
    try:
        with Path(path).open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            packed = file.read(2) == _GZIP
            file.seek(0)
            stream = gzip.GzipFile(fileobj=file) if packed else file
            while chunk := stream.read(_CHUNK):
                taken += len(chunk)
                if taken > max(_MAX_RATIO * size, _ALWAYS_UNPACKED):
                    raise SeipError(
                        f"{name} unpacks to more than {_MAX_RATIO} times its size, which no map or simulation does: "
                        "use a different file"
                    )
                parser.Parse(chunk, False)  # noqa: FBT003  # takes no name
                if taken - max(parser.CurrentByteIndex, 0) > _MAX_TOKEN:
                    raise SeipError(
                        f"{name} holds a tag or text of more than {_MAX_TOKEN >> 20} MiB, which no map or simulation "
                        f"writes; {cure}"
                    )
                yield Progress(min(file.tell(), size), size, f"reading {name}")
            parser.Parse(b"", True)  # noqa: FBT003  # takes no name
    except expat.ExpatError as error:
        raise SeipError(f"{name} is broken or unfinished XML ({error}); {cure}") from error
    except (LookupError, ValueError) as error:  # an encoding that Python or expat does not support
        raise SeipError(f"{name} is XML in an encoding that cannot be read ({error}); save it as UTF-8") from error
    except FileNotFoundError as error:
        raise SeipError(f"no such file: {path}; check its path") from error
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        raise SeipError(f"{name} is a damaged gzip file ({error}); write it again") from error
    except OSError as error:
        raise SeipError(f"cannot read {path}: {error.strerror or error}; check that it is a readable file") from error


def _parser(
    name: str, take: Callable[[str, Attributes], object], leave: Callable[[str], object] | None, cure: str
) -> expat.XMLParserType:
    """Return a parser that rejects document types and deep nesting; see `read_tags`."""
    depth = 0

    def refuse(*_: object) -> None:
        raise SeipError(f"{name} declares a document type or entities, which are not allowed; remove them")

    def start(tag: str, attributes: Attributes) -> None:
        nonlocal depth
        depth += 1
        if depth > _MAX_DEPTH:
            raise SeipError(f"{name} has more than {_MAX_DEPTH:,} nested elements; {cure}")
        take(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        if leave is not None:
            leave(tag)

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = refuse
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    # Newer expat defers unfinished tags until its buffer has doubled. Its byte index then lags far behind what it was
    # given, and `_MAX_TOKEN` would reject files of ordinary tags.
    if hasattr(parser, "SetReparseDeferralEnabled"):
        parser.SetReparseDeferralEnabled(False)  # noqa: FBT003  # takes no name
    return parser


def short(text: str) -> str:
    """Return a text from a file for a message, shortened if it is long."""
    return text if len(text) <= _MAX_QUOTED else f"{text[:_MAX_QUOTED]}…"


def quoted(text: str) -> str:
    """Return a text from a file quoted for a message: on one line, shortened if it is long."""
    return repr(short(text))
