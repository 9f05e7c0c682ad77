"""``site.npz`` written again with other figures: what cannot be is refused, whatever its digest says."""

import numpy as np
import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.output.results.site_file import FILE, load_site_file
from tests.builders.npz_by_hand import contents
from tests.core.output.report.report_folder import make_folder


def _set(name, value):
    def change(_, arrays):
        arrays[name].flat[0] = value

    return change


def _header(**values):
    return lambda header, _: header.update(values)


def _fewer_groups(header, _):
    header["groups"] = [*header["groups"], "another"]


def _more_sensors(_, arrays):
    arrays["seen"] = np.repeat(arrays["seen"], 1000, axis=0)


CHANGES = {
    "an infinite weight": (_set("weight", np.inf), "weight has the value inf, not 0 to 1,000,000"),
    "a pose beyond the site": (_set("xyz", 1e30), r"xyz has the value 1e\+30"),
    "a target of no number": (_set("targets", np.nan), "targets has the value nan"),
    "a negative price": (_set("price", -1.0), "price has the value -1"),
    "no sensors to choose": (_header(count=0), "count is 0, not 1 to"),
    "half a sensor": (_header(count=2.5), "count is 2.5, not a whole number"),
    "an endless budget": (_header(budget_usd=1e300), "budget_usd is"),
    "a negative distance": (_header(min_distance_m=-1.0), "min_distance_m is -1"),
    "a vast spacing": (_header(spacing_m=1e300), "spacing_m is"),
    "names without groups": (_fewer_groups, "it names .* mandatory groups"),
    "more sensors than poses": (_more_sensors, "sensors at .* poses"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("placed")
    make_folder(made)
    return made


@pytest.mark.parametrize("name", CHANGES)
def test_a_file_signed_again_with_impossible_figures_is_refused(folder, tmp_path, name):
    change, complaint = CHANGES[name]
    header, arrays = contents(folder / "site.npz")
    change(header, arrays)
    FILE.save(tmp_path / "site.npz", header, arrays)
    with pytest.raises(SeipError, match=complaint):
        load_site_file(tmp_path / "site.npz")
