"""View of a map in a window: which place is drawn at which pixel, and what is under the mouse."""

from dataclasses import dataclass, replace

import numpy as np

from ..base.arrays import Float

MAX_SCALE = 20.0  # pixels per metre
LEAST_OF_FITTED = 0.5  # smallest scale, in scales at which everything fits
ROOM = 0.92  # share of the frame that everything takes when it is fitted
LEAST_EXTENT = 100.0  # metres that a fitted view shows at least


@dataclass(frozen=True)
class MapView:
    """A view of a plan, north up.

    Parameters
    ----------
    middle : (x, y), metres
        Place in the middle of the frame.
    scale : float, pixels per metre
    frame : (left, bottom, right, top), pixels
        Part of the window that the map is fitted into.
    least_scale : float, pixels per metre
        Scale that the view is zoomed out to at most.
    """

    middle: tuple[float, float]
    scale: float
    frame: tuple[float, float, float, float]
    least_scale: float

    @classmethod
    def fitted(cls, points: Float, frame: tuple[float, float, float, float]) -> "MapView":
        """Return the view in which all points (n, 2), metres, are in the frame."""
        low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(2), np.zeros(2))
        left, bottom, right, top = frame
        wide, high_extent = np.maximum(high - low, LEAST_EXTENT).tolist()
        scale = min(ROOM * max(right - left, 1.0) / wide, ROOM * max(top - bottom, 1.0) / high_extent, MAX_SCALE)
        x, y = ((low + high) / 2.0).tolist()
        return cls((x, y), scale, frame, LEAST_OF_FITTED * scale)

    @property
    def origin(self) -> tuple[float, float]:
        """Pixel at which the plan's origin is drawn."""
        left, bottom, right, top = self.frame
        return (left + right) / 2.0 - self.scale * self.middle[0], (bottom + top) / 2.0 - self.scale * self.middle[1]

    def to_pixels(self, points: Float) -> Float:
        """Return the pixels (n, 2) at which places (n, 2), metres, are drawn."""
        pixels: Float = points * self.scale + self.origin
        return pixels

    def to_metres(self, pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the place that is drawn at a pixel."""
        x, y = self.origin
        return (pixel[0] - x) / self.scale, (pixel[1] - y) / self.scale

    def panned(self, dx: float, dy: float) -> "MapView":
        """Return the view after the map was dragged by a number of pixels."""
        return replace(self, middle=(self.middle[0] - dx / self.scale, self.middle[1] - dy / self.scale))

    def zoomed(self, factor: float, at: tuple[float, float]) -> "MapView":
        """Return the view magnified by a factor; the place at a pixel stays there."""
        scale = min(max(self.scale * factor, self.least_scale), MAX_SCALE)
        kept = self.to_metres(at)
        there = replace(self, scale=scale).to_metres(at)
        return replace(
            self, scale=scale, middle=(self.middle[0] + kept[0] - there[0], self.middle[1] + kept[1] - there[1])
        )

    def moved_to(self, frame: tuple[float, float, float, float]) -> "MapView":
        """Return the view with the same place in the middle of a different frame."""
        return replace(self, frame=frame)


def under_mouse(pixels: Float, radii: Float, mouse: tuple[float, float], slack: float) -> int | None:
    """Return the index of the dot under the mouse, the nearest of several, or None.

    Parameters
    ----------
    pixels : (n, 2) float64
        Middles of the dots.
    radii : (n,) float64, pixels
    slack : float, pixels
        Distance from the edge of a dot that still counts as on it.
    """
    if not len(pixels):
        return None
    beyond = np.linalg.norm(pixels - mouse, axis=1) - radii
    nearest = int(np.argmin(beyond))
    return nearest if beyond[nearest] <= slack else None
