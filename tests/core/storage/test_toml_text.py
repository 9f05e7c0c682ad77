"""Reading of the TOML files of users."""

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.sensing.lidar.catalogue import load_catalogue
from seip_addon.core.site.installed_cost import load_installed_cost
from seip_addon.core.world.streetscape.site_file import read_site_description

READERS = {
    "LiDAR catalogue": lambda path: load_catalogue((path,)),
    "installed costs": load_installed_cost,
    "site description": read_site_description,
}


@pytest.mark.parametrize("what", READERS)
def test_text_of_another_encoding_and_folders_are_refused(tmp_path, what):
    file = tmp_path / "own.toml"
    file.write_bytes("backhaul_usd = 1".encode("utf-16"))
    with pytest.raises(SeipError, match=rf"cannot read the {what} .*own\.toml: it is not UTF-8 text; name a TOML file"):
        READERS[what](file)
    with pytest.raises(SeipError, match=rf"cannot read the {what} .*: Is a directory"):
        READERS[what](tmp_path)
