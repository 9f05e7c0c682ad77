"""Files of other formats that are given in place of a map or an extract."""

GZIP = b"\x1f\x8b"
STARTS = {
    GZIP: "is compressed with gzip; unpack it (gunzip)",
    b"PK\x03\x04": "is a zip archive; unpack it",
    b"BZh": "is compressed with bzip2; unpack it (bunzip2)",
    b"\xfd7zXZ": "is compressed with xz; unpack it (unxz)",
    b"BLENDER": "is a .blend file, not a map; open it in Blender",
}
"""First bytes of other formats, and what to do with such a file."""


def other_format(start: bytes, wanted: str) -> str:
    """Return what a file is and what to do with it, from its first bytes; "" if it may be ``wanted``."""
    found = next((cure for mark, cure in STARTS.items() if start.startswith(mark)), "")
    if start.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] in (b"{", b"["):
        kind = "CityJSON, a model of buildings" if b'"CityJSON"' in start else "JSON"
        return f"is {kind}, not {wanted}"
    return found
