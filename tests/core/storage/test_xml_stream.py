"""XML as it streams by: huge tags are refused in linear time, and many ordinary ones are not."""

import gzip
import io
import time

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.storage import xml_stream
from seip_addon.core.storage.xml_stream import opened, read_tags


def test_a_huge_attribute_is_refused_at_once(tmp_path):
    path = tmp_path / "place.osm.gz"
    path.write_bytes(gzip.compress(('<osm><node k="' + "a" * (96 << 20)).encode(), compresslevel=1))
    start = time.process_time()
    with pytest.raises(SeipError, match=r"place\.osm\.gz holds a tag or text of more than 8 MiB"):
        finish(read_tags(path, lambda *_: None))
    assert time.process_time() - start < 2.0  # it took more than five seconds when each chunk was read again


@pytest.mark.parametrize("name", ["fcd.xml.gz", "fcd.csv.gz"])
def test_a_file_that_unpacks_to_a_thousand_times_its_size_is_refused(tmp_path, monkeypatch, name):
    monkeypatch.setattr(xml_stream, "_ALWAYS_UNPACKED", 1 << 20)
    path = tmp_path / name
    row = b'<timestep time="1"/>' if ".xml" in name else b"1.0;a;2.0;3.0;90.0;1.0;t\n"
    head = b"<fcd-export>" if ".xml" in name else b"timestep_time;vehicle_id;vehicle_x;vehicle_y;vehicle_angle\n"
    with gzip.open(path, "wb", compresslevel=6) as file:
        file.write(head)
        for _ in range(4):
            file.write(row * ((1 << 20) // len(row)))
    read = read_tags(path, lambda *_: None) if ".xml" in name else _lines(path)
    with pytest.raises(SeipError, match="unpacks to more than 200 times its size"):
        finish(read)


def _lines(path):
    with opened(path) as (stream, progress):
        for _ in io.TextIOWrapper(stream, encoding="utf-8"):
            pass
        yield progress()


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
