"""LAZ, the compressed form of LAS 1.4, for surveyors' programs and geographic information systems.

Coordinates are those of the map. Where the map names a projection that is known they are projected ones, map
coordinates and the offset of the map's header, and the file says so: the record ``LASF_Projection`` 2112 holds the
reference system as well-known text 1 (OGC 01-009), as point format 6 asks for. It has no vertical part, because
OpenDRIVE does not say what heights count from.

One file for each frame, in point format 6. The point source id is the number of the sensor from 1, because 0 means
the file itself; the GPS time is the time of the simulation; the intensity has 16 bits; the extra dimension
``instance`` is the road user, −1 for none. Source: ASPRS, "LAS Specification 1.4 - R15".
"""

import io
from collections.abc import Callable

import numpy as np

from ...storage.las_file import laspy_for
from .format_interface import Format
from .sample import Sample, TrafficRun

RESOLUTION = 0.001  # of coordinates, metres

CREATION_DATE_BYTES = range(90, 94)
"""The bytes of the header in which laspy puts the day of writing; zeros, for not known, keep them out of the file."""


def sample_files(sample: Sample) -> dict[str, Callable[[], bytes]]:
    """Return ``SPLIT/RUN/FRAME.laz``."""
    return {f"{sample.run.split}/{sample.run.name}/{sample.frame_id}.laz": lambda: _laz(sample)}


def notes(run: TrafficRun) -> tuple[str, ...]:  # noqa: ARG001  # the same for every run
    """Note nothing, but see that LAZ can be written here."""
    laspy_for("writing LAZ", compressed=True)
    return ()


def _laz(sample: Sample) -> bytes:
    laspy = laspy_for("writing LAZ", compressed=True)
    frame = sample.frame
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales = np.full(3, RESOLUTION)
    mercator, origin = sample.run.geo_reference.mercator, sample.run.origin
    if mercator is not None:
        origin = sample.run.geo_reference.projected(origin[None])[0]
        header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(mercator.wkt))
    header.offsets = np.round(origin)
    header.generating_software = "SEIP"
    header.system_identifier = "simulation"
    header.global_encoding.wkt = True  # what point format 6 requires, with or without a reference system
    header.add_extra_dim(laspy.ExtraBytesParams("instance", np.int32, "road user, -1 for none"))
    points = laspy.LasData(header)
    points.x, points.y, points.z = (frame.points.astype(np.float64) + origin).T
    points.intensity = np.round(np.clip(frame.intensity, 0.0, 1.0) * 65535).astype(np.uint16)
    points.point_source_id = (frame.sensor + 1).astype(np.uint16)
    points.gps_time = frame.time + frame.delay.astype(np.float64)
    points.return_number = points.number_of_returns = np.ones(len(frame), dtype=np.uint8)
    points.instance = frame.instance
    buffer = io.BytesIO()
    points.write(buffer, do_compress=True, laz_backend=laspy.LazBackend.Lazrs)
    content = buffer.getvalue()
    return content[: CREATION_DATE_BYTES.start] + bytes(len(CREATION_DATE_BYTES)) + content[CREATION_DATE_BYTES.stop :]


FORMAT = Format("las", "LAZ clouds", {}, sample_files, notes=notes)
