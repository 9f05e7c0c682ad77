"""A view and the plan side by side, for a report."""

import os

from PIL import Image

from ...storage.files import whole_file
from .palette import PAPER

GAP = 24  # pixels between the two, and around them


def save_sheet(path: str | os.PathLike[str], view: Image.Image, plan: Image.Image) -> None:
    """Put a view to the left of a plan, scaled to the plan's width, as PNG."""
    high = round(view.height * plan.width / view.width)
    sheet = Image.new("RGB", (2 * plan.width + 3 * GAP, max(high, plan.height) + 2 * GAP), PAPER)
    sheet.paste(view.convert("RGB").resize((plan.width, high), Image.Resampling.LANCZOS), (GAP, GAP))
    sheet.paste(plan.convert("RGB"), (plan.width + 2 * GAP, GAP))
    with whole_file(path) as temporary:
        sheet.save(temporary, format="PNG")
