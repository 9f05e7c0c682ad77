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
    Pictures,
    Report,
    Section,
    Table,
)
from seip_addon.core.output.report.pdf import BOTTOM, as_pdf
from tests.few import few

PAGE = 842.0  # points
TEXT = "A sensor sees the road where a measured point lies near the middle of a square. "


def png(width, height):
    content = io.BytesIO()
    Image.new("RGB", (width, height), "navy").save(content, format="PNG")
    return content.getvalue()


def lowest_marks(pdf):
    """Return how far down each page texts and pictures reach, above its foot; points from the top."""
    lowest = []
    for packed in re.findall(rb"/Filter /FlateDecode\n/Length \d+\n>>\nstream\n(.*?)\nendstream", pdf, re.DOTALL):
        page = zlib.decompress(packed)
        if b" Td " not in page:
            continue
        texts = [float(y) for y in re.findall(rb"BT [\d.]+ ([\d.]+) Td", page)]
        images = [float(y) for y in re.findall(rb"q [\d.]+ 0 0 [\d.]+ [\d.]+ ([\d.]+) cm", page)]
        lowest.append(PAGE - min(y for y in (*texts, *images) if y > BOTTOM - 1.0))
    return lowest


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
                        Card("S1", (Pictures((png(64, 48),) * 2, TEXT), Facts(rows))),
                    )
                )
            )
        yield Section(f"Section {number}", tuple(blocks))


@pytest.mark.parametrize("seed", few(range(12), 4))
def test_pages_are_more_than_half_full(seed):
    first = (Facts((("Where", TEXT),), large=True), Picture(png(600, 500), "View"), Paragraph(TEXT * (4 + 2 * seed)))
    plan = Section("Plan", (Picture(png(600, 800), "Plan", tall=True),))
    report = Report("Crossing", "Positions", "2026-01-02T03:04:05+00:00", first, (plan, *sections(seed)))
    *pages, _ = lowest_marks(as_pdf(report))
    assert len(pages) > 4
    assert min(pages) > 0.5 * PAGE
