"""What a detector's file holds is checked once, where it is read."""

import math

from headless.detection.detector import Detector, TrainingRecord
from headless.detection.pillars import grid_over
from headless.detection.settings import NetworkSettings

import numpy as np
import pytest
import torch

from seip_addon.core.errors import SeipError

NETWORK = NetworkSettings(width=8, blocks=(0, 0, 0), most_points=2)
GRID = grid_over((0.0, 0.0, 16.0, 16.0), (0.0, 4.0), NETWORK.pillar)


@pytest.fixture
def stored(tmp_path):
    path = tmp_path / "detector.pt"
    Detector(NETWORK, GRID, seed=1, training_record=TrainingRecord(("type1",), ("Junction",))).save(path)
    return path


def written(path, change):
    """Change a file's content, as a file of the version that has no digest."""
    state = torch.load(path, weights_only=True)
    del state["digest"]
    state["version"] = 1
    change(state)
    torch.save(state, path)
    return path


def _set(table, name, value):
    def change(state):
        state[table][name] = value

    return change


def _first(value):
    def change(state):
        next(iter(state["weights"].values())).flatten()[0] = value

    return change


def _experience(value):
    def change(state):
        state["experience"] = value

    return change


def _expanded(state):
    name = next(iter(state["weights"]))
    state["weights"][name] = torch.zeros(1).expand(2**34)


CHANGES = {
    "a weight that is no number": (_first(math.nan), "weights are not finite"),
    "an endless weight": (_first(math.inf), "weights are not finite"),
    "columns below zero": (_set("grid", "columns", -5), "no or too many pillars"),
    "half a row": (_set("grid", "rows", 2.5), "no or too many pillars"),
    "rows without end": (_set("grid", "rows", 10**9), "no or too many pillars"),
    "a grid at no place": (_set("grid", "west", math.nan), "grid is nowhere"),
    "a grid upside down": (_set("grid", "top", -1.0), "grid is nowhere"),
    "pillars of its own": (_set("grid", "pillar", 0.5), "pillars of 0.5 m"),
    "a width out of range": (_set("settings", "width", 10**6), "width must lie between"),
    "a width in halves": (_set("settings", "width", 8.5), "width must lie between"),
    "a setting that nobody knows": (_set("settings", "depth", 3), "damaged"),
    "a number for what it has learnt from": (_experience(3), "damaged"),
    "numbers for sensors": (_experience({"sensors": [1, 2]}), "no names"),
    "letters for sensors": (_experience({"sensors": "type1"}), "no names"),
    "tensors larger than the file": (_expanded, "larger than itself"),
}


@pytest.mark.parametrize(("change", "sentence"), CHANGES.values(), ids=CHANGES)
def test_detectors_that_make_no_sense_are_refused(stored, change, sentence):
    with pytest.raises(SeipError, match="train it again") as refusal:
        Detector.load(written(stored, change))
    assert sentence in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_file_of_the_version_without_a_digest_is_read(stored):
    assert Detector.load(written(stored, lambda _state: None)).grid == GRID


def test_other_weights_than_were_written_are_noticed(stored):
    state = torch.load(stored, weights_only=True)
    next(iter(state["weights"].values())).flatten()[0] += 1.0
    torch.save(state, stored)
    with pytest.raises(SeipError, match="not what was written"):
        Detector.load(stored)


def test_a_flipped_bit_is_a_sentence_or_nothing_lost(stored):
    whole, before = stored.read_bytes(), Detector.load(stored)
    random = np.random.default_rng(3)
    refused = 0
    for place in random.integers(len(whole), size=150).tolist():
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(random.integers(8))
        stored.write_bytes(damaged)
        try:
            after = Detector.load(stored)
        except SeipError:
            refused += 1
        else:
            assert after.description() == before.description()
            assert all(bool((after.state_dict()[name] == value).all()) for name, value in before.state_dict().items())
    assert refused > 50
