"""Warnings where a detector is used beyond the sensor types and sites that it was trained on."""

from collections.abc import Sequence

from .detector import Detector


def suitability_warnings(detector: Detector, sensors: Sequence[str], site: str) -> tuple[str, ...]:
    """Return warnings about using a detector beyond the types and the sites that it was trained on.

    Parameters
    ----------
    sensors : sequence of str
        Catalogue keys of the types whose clouds it is used on.
    site : str
        Name of the site, or "".
    """
    found = (_of_types(detector, sensors), _of_site(detector, site))
    return tuple(sentence for sentence in found if sentence)


def _of_types(detector: Detector, sensors: Sequence[str]) -> str:
    trained, foreign = detector.training_record.sensors, sorted(set(sensors) - set(detector.training_record.sensors))
    if not trained or not foreign:
        return ""
    return (
        f"the detector was trained on clouds of {' and '.join(trained)}, not of {' and '.join(foreign)}: "
        "test it on clouds of these types before you trust it with them, or train it on them too"
    )


def _of_site(detector: Detector, site: str) -> str:
    sites = detector.training_record.sites
    if not site or len(sites) != 1 or site in sites:
        return ""
    return (
        f"the detector was trained only at {sites[0]}, not at {site}: at other sites it may find less than the "
        "shipped detector, which was trained at many sites"
    )
