"""Runs of traffic beside a scene: their order, their split and what is refused."""

import pytest

from seip_addon.core.base.errors import SeipError
from seip_addon.core.base.progress import finish
from seip_addon.core.workflows.traffic_runs import found_runs, read_runs


def test_a_folder_without_runs_is_named(tmp_path):
    with pytest.raises(SeipError, match=str(tmp_path)):
        found_runs(tmp_path)


def test_a_run_that_is_given_twice_is_named(small_layout, tmp_path):
    path = tmp_path / "run.npz"
    with pytest.raises(SeipError, match=r"run\.npz is named twice"):
        finish(read_runs([path, path], small_layout))
