"""Layout of the PDF."""

import io
import random
import re
import zlib

import pytest
from PIL import Image

from seip_addon.core.output.report.blocks import (
    Bullets,
    Card,
    Facts,
    Paragraph,
    Picture,
    Report,
    Table,
)
from seip_addon.core.output.report.pdf import BOTTOM, HEADING, as_pdf
from tests.few import few

PAGE = 842.0  # points
TEXT = "A sensor sees the road where a measured point lies near the middle of a square. "


def png(width, height):
    content = io.BytesIO()
    Image.new("RGB", (width, height), "navy").save(content, format="PNG")
    return content.getvalue()


def pages_of(pdf):
    """Yield for each page the size of type and the height of its texts, from the foot of the page, and the pictures."""
    for packed in re.findall(rb"/Filter /FlateDecode\n/Length \d+\n>>\nstream\n(.*?)\nendstream", pdf, re.DOTALL):
        page = zlib.decompress(packed)
        if b" Td " not in page:
            continue
        size, texts = 0.0, []
        for chosen, y in re.findall(rb"/F\d+ ([\d.]+) Tf|BT [\d.]+ ([\d.]+) Td", page):
            if chosen:
                size = float(chosen)
            else:
                texts.append((size, float(y)))
        images = [float(y) for y in re.findall(rb"q [\d.]+ 0 0 [\d.]+ [\d.]+ ([\d.]+) cm", page)]
        yield [(size, y) for size, y in texts if y > BOTTOM - 1.0], [y for y in images if y > BOTTOM - 1.0]


def lowest_marks(pdf):
    """Return how far down each page texts and pictures reach, above its foot; points from the top."""
    return [PAGE - min([*(y for _, y in texts), *images]) for texts, images in pages_of(pdf)]


def sections(seed):
    chance = random.Random(seed)  # noqa: S311  # for test data
    for number in range(8):
        blocks = []
        for _ in range(chance.randint(1, 5)):
            rows = tuple((str(row), TEXT[: chance.randint(5, 40)]) for row in range(chance.randint(2, 9)))
            blocks.append(
                chance.choice(
                    (
                        Paragraph(TEXT * chance.randint(1, 6)),
                        Bullets((TEXT,) * chance.randint(1, 5)),
                        Table(("Number", "Text"), rows),
                        Facts(rows),
                        Picture(png(600, chance.randint(200, 700)), TEXT),
                        Card("S1", (Facts(rows),)),
                    )
                )
            )
        yield f"Section {number}", tuple(blocks)


@pytest.mark.parametrize("seed", few(range(12), 4))
def test_pages_are_more_than_half_full(seed):
    first = (Facts((("Where", TEXT),), large=True), Picture(png(600, 500), "View"), Paragraph(TEXT * (4 + 2 * seed)))
    plan = {"Plan": (Picture(png(600, 800), "Plan", tall=True),)}
    report = Report("Crossing", "Positions", "2026-01-02T03:04:05+00:00", first, plan | dict(sections(seed)))
    *pages, _ = lowest_marks(as_pdf(report))
    assert len(pages) > 4
    assert min(pages) > 0.5 * PAGE


@pytest.mark.parametrize("filled", few((38, 41, 44, *range(30, 38), 39, 40, 42, 43), 3))
def test_no_heading_ends_a_page(filled):
    """Whatever precedes it, the first block of a section that stays whole is on the page of its heading."""
    rows = tuple((str(row), TEXT) for row in range(9))
    firsts = (Table(("Number", "Text"), rows), Facts(rows), Card("S1", (Facts(rows),)), Picture(png(600, 400), "View"))
    for first in firsts:
        report = Report(
            "Crossing",
            "Positions",
            "2026-01-02T03:04:05+00:00",
            (Paragraph(TEXT),),
            {"Before": (Bullets(("Line",) * filled),), "After": (first,)},
        )
        headings = 0
        for texts, images in pages_of(as_pdf(report)):
            below = [*(y for size, y in texts if size != HEADING), *images]
            for _, heading in filter(lambda text: text[0] == HEADING, texts):
                assert min(below) < heading
                headings += 1
        assert headings == 2
