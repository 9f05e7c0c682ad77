"""Settings of the whole suite, and its end."""

import os
import sys

import pytest
from hypothesis import settings

# Shared machines stall at random: speed is the benchmarks' business. The same examples every time.
settings.register_profile("seip", deadline=None, derandomize=True)
settings.load_profile("seip")

STATUS = pytest.StashKey[int]()


def pytest_sessionfinish(session, exitstatus):
    session.config.stash[STATUS] = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    """End the process here where Blender's module was loaded.

    Blender ends itself when Python frees its module. Whatever still refers to the module at the end of a long run
    prevents that, and then Blender's own thread for sound keeps the process from ending at all.
    """
    if "bpy" in sys.modules and STATUS in config.stash:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(config.stash[STATUS])


@pytest.fixture(scope="session")
def small_scene(tmp_path_factory):
    """A scene that every command runs on in a moment, with traffic beside it."""
    pytest.importorskip("bpy")
    from small_scene import save_small_scene  # noqa: PLC0415 -- Blender's module need not be there

    return save_small_scene(tmp_path_factory.mktemp("small"))
