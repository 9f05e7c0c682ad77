"""Pictures are small, and their colours are those that were drawn."""

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread

from seip_addon.core.output.pictures.drawing import save_png
from seip_addon.core.output.pictures.palette import SEEN_COLOURS


def noisy_figure():
    """A grainy picture with a small patch of each colour that has a meaning."""
    figure = Figure((4.0, 3.0), dpi=100)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.axis("off")
    grain = np.random.default_rng(0).normal(0.0, 0.02, (300, 400, 3))
    pixels = np.clip(np.linspace((0.2, 0.3, 0.2), (0.8, 0.8, 0.7), 400) + grain, 0.0, 1.0)
    for index, colour in enumerate(SEEN_COLOURS):
        pixels[10:14, 10 + 20 * index : 14 + 20 * index] = to_rgb(colour)
    axes.imshow(pixels, aspect="auto", interpolation="nearest")
    return figure, pixels


def test_colours_that_carry_meaning_survive_among_many(tmp_path):
    figure, pixels = noisy_figure()
    save_png(tmp_path / "a.png", figure)
    written = imread(tmp_path / "a.png")[:, :, :3]
    assert written.shape == pixels.shape
    for index, colour in enumerate(SEEN_COLOURS):
        assert np.abs(written[12, 12 + 20 * index] - to_rgb(colour)).max() < 0.03
    assert np.sqrt(((written - pixels) ** 2).mean()) < 0.02


def test_the_file_is_small_and_the_same_each_time(tmp_path):
    for name in ("a.png", "b.png"):
        save_png(tmp_path / name, noisy_figure()[0])
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    noisy_figure()[0].savefig(tmp_path / "plain.png")
    assert (tmp_path / "a.png").stat().st_size < (tmp_path / "plain.png").stat().st_size / 2
