"""Comparisons with measured sensors as text and as JSON."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from typing import Any

from seip_addon.core.sensing.lidar.range_equation import RangeEquation
from seip_addon.core.storage.files import save_json

from .comparison import Comparison, NoiseRatio

SCHEMA = "seip-calibration/1"


def describe(one: Comparison) -> Iterator[str]:
    """Yield the lines of a comparison's table."""
    yield f"{one.name} ({one.sensor.identity.sensor}, {one.sensor.height:g} m high) and {one.model.key}"
    if one.fits is None:
        yield "  share returned     no bin has enough rays"
    else:
        fits = one.fits
        for what, law, misfit in zip(
            ("catalogue", "gain", "m, s and c"), (fits.catalogue, fits.gain, fits.free), fits.misfits, strict=True
        ):
            lost = f", {law.extinction:g}/m lost in air" if law.extinction else ""
            yield f"  share, {what:10}  rms {misfit:.3f} over {fits.bins} bins; {_numbers(law)}{lost}"
        if fits.determined:
            yield f"  detection_law = {_numbers(fits.free)}"
        else:
            yield "  no detection_law   these bins do not determine threshold and spread: the fit is at its limits"
    beams = one.beams
    yield f"  elevations         largest difference {beams.elevation_largest:.2f}°, rms {beams.elevation_rms:.2f}°"
    yield f"  azimuth offsets    largest difference {beams.azimuth_largest:.2f}°, rms {beams.azimuth_rms:.2f}°"
    for what, ratios in (("ground", one.ground_noise), ("vertical", one.vertical_noise)):
        shown = ", ".join(f"{ratio.bin.bin} m {ratio.ratio:.1f}" for ratio in ratios) or "not measured"
        yield f"  noise, {what:10}  model / measured: {shown}"
    along = (
        f"{lag} on {one.fates.along_ring[lag]:.2f} ({value:.2f})"
        for lag, value in one.sensor.fate_correlation.items()
        if one.fates.along_ring
    )
    yield f"  fate along a ring  model (measured): {', '.join(along) or 'no rings at 20 to 100 m'}"
    over = (f"{bin_} m {model:.2f} ({measured:.2f})" for bin_, model, measured in _over_sweeps(one))
    yield f"  fate over sweeps   model (measured): {', '.join(over) or 'not measured'}"


def save_calibration(path: str | os.PathLike[str], comparisons: Sequence[Comparison]) -> None:
    """Write comparisons as JSON."""
    save_json(path, {"schema": SCHEMA, "comparisons": [_record(one) for one in comparisons]})


def _record(one: Comparison) -> dict[str, Any]:
    fits = one.fits
    return {
        "measured": one.name,
        "model": one.model.key,
        "share": None
        if fits is None
        else {
            "bins": fits.bins,
            "determined": fits.determined,
            **{
                name: {
                    "rms": round(misfit, 4),
                    "detection_law": _rounded(law),
                    "extinction_per_m": round(law.extinction, 6),
                }
                for name, law, misfit in zip(
                    ("catalogue", "gain", "free"), (fits.catalogue, fits.gain, fits.free), fits.misfits, strict=True
                )
            },
        },
        "beams": {
            "elevation_largest_deg": round(one.beams.elevation_largest, 3),
            "elevation_rms_deg": round(one.beams.elevation_rms, 3),
            "azimuth_largest_deg": round(one.beams.azimuth_largest, 3),
            "azimuth_rms_deg": round(one.beams.azimuth_rms, 3),
        },
        "range_noise_ratio": {
            "ground": _ratios(one.ground_noise),
            "vertical": _ratios(one.vertical_noise),
        },
        "fate_along_ring": [
            {"lag": lag, "model": round(one.fates.along_ring[lag], 3), "measured": value}
            for lag, value in one.sensor.fate_correlation.items()
            if one.fates.along_ring
        ],
        "fate_over_sweeps": [
            {"bin": bin_, "model": round(model, 3), "measured": measured} for bin_, model, measured in _over_sweeps(one)
        ],
    }


def _over_sweeps(one: Comparison) -> Iterator[tuple[str, float, float]]:
    """Yield bin, intraclass correlation of the model, and the measured one."""
    for each in one.sensor.ground_by_range_m_over_20_sweeps:
        if each.bin in one.fates.over_sweeps:
            yield each.bin, one.fates.over_sweeps[each.bin], each.intraclass_correlation


def _ratios(ratios: Sequence[NoiseRatio]) -> dict[str, float]:
    return {one.bin.bin: round(one.ratio, 3) for one in ratios}


def _rounded(law: RangeEquation) -> list[float]:
    return [round(law.threshold, 3), round(law.spread, 3), round(law.ceiling, 4)]


def _numbers(law: RangeEquation) -> str:
    return str(_rounded(law))
