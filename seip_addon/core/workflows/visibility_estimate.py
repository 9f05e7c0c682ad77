"""Estimated run time and memory of the visibility grid of a survey."""

from collections.abc import Generator

from ..progress import Progress
from ..sensing.visibility.estimate import Estimate, estimate_visibility
from .survey import Layout


def estimate(layout: Layout, threads: int | None = None) -> Generator[Progress, None, Estimate]:
    """Estimate the run time and memory of `see` without a stored grid; see `estimate_visibility`."""
    settings = layout.settings
    return estimate_visibility(layout.site, layout.models, settings.visibility, settings.engine, threads)
