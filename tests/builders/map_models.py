"""Models of places on OpenDRIVE maps."""

from seip_addon.core.base.progress import finish
from seip_addon.core.world.streetscape.description import SiteDescription
from seip_addon.core.world.streetscape.model import street_model
from seip_addon.core.world.streetscape.street_map import opendrive_streets
from tests.builders.opendrive_text import read_text
from tests.builders.street_map import street_map

HERE = SiteDescription(near=(0.0, 0.0), radius=30.0)


def site_model(road_map, description):
    """Model a place of a map, as a generator of its progress."""
    streets = yield from opendrive_streets(road_map)
    return (yield from street_model(streets, description))


def model_of_street(folder, description=HERE, **options):
    """Return the model of a place on `street_map` with options."""
    return finish(site_model(read_text(folder, street_map(**options)), description))
