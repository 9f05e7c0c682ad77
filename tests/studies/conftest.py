"""Tests of the studies. What needs torch is skipped without it; the longest are marked slow."""

import importlib.util
from pathlib import Path

import pytest

from tests.detection.conftest import WithoutTorch

HERE = Path(__file__).parent
WITHOUT_TORCH = {"benchmark", "coverage", "random_sites", "stability"}
SLOW = {"benchmark", "stability"}


def pytest_pycollect_makemodule(module_path, parent):
    if importlib.util.find_spec("torch") is None and study_of(module_path) not in WITHOUT_TORCH:
        return WithoutTorch.from_parent(parent, path=module_path)
    return None


def pytest_collection_modifyitems(items):
    for item in items:
        if study_of(item.path) in SLOW:
            item.add_marker(pytest.mark.slow)


def study_of(path):
    """Name of the study that a test file is about, or None."""
    return path.parent.name if HERE in path.parents else None
