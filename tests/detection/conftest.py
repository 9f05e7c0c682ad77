"""The detector needs torch, which is an extra: without it these tests are skipped, each file with the reason."""

import importlib.util

import pytest


class WithoutTorch(pytest.File):
    """A file of tests that cannot be run."""

    def collect(self):
        pytest.skip("torch is not installed: pip install --group detection", allow_module_level=True)


def pytest_pycollect_makemodule(module_path, parent):
    if importlib.util.find_spec("torch") is None:
        return WithoutTorch.from_parent(parent, path=module_path)
    return None
