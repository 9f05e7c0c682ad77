"""XML files read as they stream by: they may be larger than memory, and nothing in them is trusted."""

import gzip
import os
import zlib
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, cast
from xml.parsers import expat  # document types, through which XML does harm, are refused below

from ..errors import SeipError
from ..progress import Progress

Attributes = dict[str, str]

SUMO_CURE = "let SUMO finish writing it"
_MAX_QUOTED = 60  # characters of a file that a message repeats
_CHUNK = 1 << 20
_GZIP = b"\x1f\x8b"


@contextmanager
def opened(path: str | os.PathLike[str]) -> Iterator[tuple[BinaryIO, Callable[[], Progress]]]:
    """Open a file, unpacked where it is packed with gzip.

    Yields
    ------
    stream : binary file
    progress : callable
        How much of the file has been read.

    Raises
    ------
    SeipError
        The file is not there, cannot be read, or is damaged; also from within the block.
    """
    name = Path(path).name
    try:
        with Path(path).open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            packed = file.read(2) == _GZIP
            file.seek(0)
            stream = cast(BinaryIO, gzip.GzipFile(fileobj=file) if packed else file)
            yield stream, lambda: Progress(min(file.tell(), size), size, f"reading {name}")
    except FileNotFoundError as error:
        raise SeipError(f"no such file: {path}; check its path") from error
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        raise SeipError(f"{name} is a damaged gzip file ({error}); write it again") from error
    except OSError as error:
        raise SeipError(f"cannot read {path}: {error.strerror or error}; check that it is a readable file") from error


def read_tags(
    path: str | os.PathLike[str],
    take: Callable[[str, Attributes], object],
    leave: Callable[[str], object] | None = None,
    *,
    cure: str = SUMO_CURE,
) -> Generator[Progress, None, None]:
    """Call ``take`` with the name and the attributes of each element, in the order of the file.

    Parameters
    ----------
    leave : callable, optional
        Called with the name of each element where it ends.
    cure : str
        What to do where the XML is broken.

    Yields
    ------
    Progress
        After each mebibyte.

    Raises
    ------
    SeipError
        The file cannot be read, is not well-formed XML, or declares a document type: none is needed, and through
        one a file can reach for other files or blow up in memory.
    """
    name = Path(path).name

    def refuse(*_: object) -> None:
        raise SeipError(f"{name} declares a document type or entities, which may not be; remove them")

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = refuse
    parser.StartElementHandler = take
    parser.EndElementHandler = leave
    with opened(path) as (stream, progress):
        try:
            while chunk := stream.read(_CHUNK):
                parser.Parse(chunk, False)  # noqa: FBT003  # takes no name
                yield progress()
            parser.Parse(b"", True)  # noqa: FBT003  # takes no name
        except expat.ExpatError as error:
            raise SeipError(f"{name} is broken or unfinished XML ({error}); {cure}") from error
        except (LookupError, ValueError) as error:  # of an encoding that Python knows not, or expat does not take
            raise SeipError(f"{name} is XML in an encoding that cannot be read ({error}); save it as UTF-8") from error


def short(text: str) -> str:
    """Return a text out of a file as a message repeats it: cut where it is long."""
    return text if len(text) <= _MAX_QUOTED else f"{text[:_MAX_QUOTED]}…"


def quoted(text: str) -> str:
    """Return a text out of a file as a message quotes it: cut where it is long, and on one line."""
    return repr(short(text))
