"""Models of places on OpenDRIVE maps."""

from seip_addon.core.world.streetscape.model import street_model
from seip_addon.core.world.streetscape.street_map import opendrive_streets


def site_model(road_map, description):
    """Model a place of a map, as a generator of its progress."""
    streets = yield from opendrive_streets(road_map)
    return (yield from street_model(streets, description))
