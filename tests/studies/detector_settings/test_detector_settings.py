"""The command that charts what other settings of the detector cost and gain."""

import json
from dataclasses import replace

import pytest

pytest.importorskip("torch", reason="torch is not installed: make detection")

from headless.studies.detector_settings import command as compare_detectors

from matplotlib.image import imread

COARSE = ["--sensor", "type1", "--heights", "5.4", "--grid", "8", "--spacing", "20", "--every", "29", "--steps", "2"]


def test_each_setting_gets_its_price_and_its_precision(small_scene, tmp_path, monkeypatch):
    default = compare_detectors.DEFAULT_NETWORK
    small = {("default", "default"): default, ("pillars", "0.5 m"): replace(default, pillar=0.5)}
    monkeypatch.setattr(compare_detectors, "NETWORKS", small)
    compare_detectors.main([str(small_scene), "-o", str(tmp_path), *COARSE])
    first, second = json.loads((tmp_path / "settings.json").read_text(encoding="utf-8"))
    assert (first["name"], first["default"], second["name"], second["default"]) == ("default", True, "0.5 m", False)
    for setting in (first, second):
        assert setting["training"] > 0
        assert setting["inference"] > 0
        assert 0 <= setting["average_precision"] <= 1
    assert imread(tmp_path / "settings.png").shape[1] > 600


def test_the_settings_hold_the_default_and_the_published():
    assert list(compare_detectors.NETWORKS.values()).count(compare_detectors.DEFAULT_NETWORK) == 1
    assert compare_detectors.PUBLISHED_NETWORK in compare_detectors.NETWORKS.values()
