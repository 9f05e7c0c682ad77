"""XML as it streams by: huge tags are refused in linear time, and many ordinary ones are not."""

import gzip
import time

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.storage import xml_stream
from seip_addon.core.storage.xml_stream import read_tags


def test_a_huge_attribute_is_refused_at_once(tmp_path):
    path = tmp_path / "place.osm.gz"
    path.write_bytes(gzip.compress(('<osm><node k="' + "a" * (96 << 20)).encode(), compresslevel=1))
    start = time.process_time()
    with pytest.raises(SeipError, match=r"place\.osm\.gz holds a tag or text of more than 8 MiB"):
        finish(read_tags(path, lambda *_: None))
    assert time.process_time() - start < 2.0  # it took more than five seconds when each chunk was read again


def test_a_file_that_unpacks_to_a_thousand_times_its_size_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(xml_stream, "_ALWAYS_UNPACKED", 1 << 20)
    path = tmp_path / "fcd.xml.gz"
    row = b'<timestep time="1"/>'
    with gzip.open(path, "wb", compresslevel=6) as file:
        file.write(b"<fcd-export>")
        for _ in range(4):
            file.write(row * ((1 << 20) // len(row)))
    with pytest.raises(SeipError, match="unpacks to more than 200 times its size"):
        finish(read_tags(path, lambda *_: None))


def test_large_files_of_ordinary_tags_are_read(tmp_path):
    path = tmp_path / "net.xml"
    shape = " ".join(f"{number},{number}" for number in range(100_000))
    path.write_text(f"<net>{f'<edge shape={chr(34)}{shape}{chr(34)}/>' * 12}</net>", encoding="utf-8")
    tags: list[str] = []
    finish(read_tags(path, lambda tag, _: tags.append(tag)))
    assert tags == ["net", *["edge"] * 12]


def test_elements_nested_without_end_are_refused_at_once(tmp_path):
    path = tmp_path / "place.osm.gz"
    path.write_bytes(gzip.compress(b"<a>" * 1_000_000))
    tags: list[str] = []
    with pytest.raises(SeipError, match=r"place\.osm\.gz has more than 1,000 nested elements"):
        finish(read_tags(path, lambda tag, _: tags.append(tag)))
    assert len(tags) == 1000
