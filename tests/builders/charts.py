"""Contents of charts, read back from what was drawn."""

import numpy as np
from PIL import Image


def record_figures(monkeypatch, *modules):
    """Return a list to which each figure that the modules save is added."""
    saved = []
    save = modules[0].save_png

    def keep(path, figure):
        saved.append(figure)
        save(path, figure)

    for module in modules:
        monkeypatch.setattr(module, "save_png", keep)
    return saved


def line(panel, label):
    """Return the line with a label."""
    return next(drawn for drawn in panel.get_lines() if drawn.get_label() == label)


def words(figure):
    """Return the texts in the panels."""
    return [text.get_text() for panel in figure.axes for text in panel.texts]


def legend(figure):
    """Return the texts of the legend."""
    return [text.get_text() for text in figure.legends[0].get_texts()]


def is_drawn(path):
    """A picture of some size with as much on it as a chart has."""
    picture = np.asarray(Image.open(path).convert("L"))
    return min(picture.shape) > 400 and 0.005 < (picture < 200).mean() < 0.5
