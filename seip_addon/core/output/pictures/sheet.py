"""A view and the plan side by side, for a report."""

import os

from PIL import Image

from ...storage.files import whole_file
from .palette import PAPER

GAP = 24  # pixels between the two, and around them


def save_sheet(path: str | os.PathLike[str], view: Image.Image, plan: Image.Image) -> None:
    """Put a view to the left of a plan, scaled to the plan's height, as PNG."""
    wide = round(view.width * plan.height / view.height)
    sheet = Image.new("RGB", (wide + plan.width + 3 * GAP, plan.height + 2 * GAP), PAPER)
    sheet.paste(view.convert("RGB").resize((wide, plan.height), Image.Resampling.LANCZOS), (GAP, GAP))
    sheet.paste(plan.convert("RGB"), (wide + 2 * GAP, GAP))
    with whole_file(path) as temporary:
        sheet.save(temporary, format="PNG")
