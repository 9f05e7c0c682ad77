"""Single units of known models in a catalogue."""

import math

import pytest

from seip_addon.core.errors import SeipError
from seip_addon.core.sensing.lidar.catalogue import load_catalogue

UNIT = '[mine]\nlike = "vlp16"\ngain = 0.5\n'


def catalogue_of(tmp_path, text):
    path = tmp_path / "units.toml"
    path.write_text(text, encoding="utf-8")
    return load_catalogue([path])


def test_a_unit_is_its_model_with_another_gain(tmp_path):
    catalogue = catalogue_of(tmp_path, UNIT + 'name = "VLP-16, unit S1"\ncalibration = "recording sweeps"\n')
    unit, model = catalogue["mine"], catalogue["vlp16"]
    assert unit.beams_key == model.beams_key
    assert (unit.key, unit.name, unit.calibration) == ("mine", "VLP-16, unit S1", "recording sweeps")
    assert unit.law.threshold == pytest.approx(model.law.threshold + math.log(2.0))
    assert unit.gains == (1.0, 1.0)  # it was measured


def test_a_unit_without_a_measurement_keeps_the_doubt_of_its_model(tmp_path):
    catalogue = catalogue_of(tmp_path, UNIT)
    assert catalogue["mine"].gains == catalogue["vlp16"].gains
    assert catalogue["mine"].name == catalogue["vlp16"].name


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            '[mine]\nlike = "vlp17"\ngain = 0.5\n',
            r"LiDAR 'mine' in .*units.toml: no LiDAR 'vlp17' .* did you mean vlp16",
        ),
        ('[mine]\nlike = "vlp16"\n', "LiDAR 'mine' .* gain"),
        (UNIT + "channels = 3\n", "LiDAR 'mine' .* unknown key 'channels'"),
        ('[mine]\nlike = "vlp16"\ngain = 0.0\n', "LiDAR 'mine' .* gain"),
    ],
)
def test_a_wrong_unit_has_its_sentence(tmp_path, text, sentence):
    with pytest.raises(SeipError, match=sentence):
        catalogue_of(tmp_path, text)
