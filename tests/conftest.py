"""Settings of the whole suite, and its end."""

import os
import sys

import pytest
from hypothesis import settings

# Shared machines stall at random: speed is the benchmarks' business. The same random cases every time: a dozen of each
# property, hypothesis's hundred where `make test-long` runs them all.
settings.register_profile("quick", max_examples=12, deadline=None, derandomize=True)
settings.register_profile("thorough", deadline=None, derandomize=True)

STATUS = pytest.StashKey[int]()


def pytest_configure(config):
    settings.load_profile("thorough" if "long or" in config.getoption("markexpr") else "quick")


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
def example():
    """The small junction with three sensors, which nobody changes."""
    from tests.builders.small_junction import make_example  # noqa: PLC0415 -- most tests do without it

    return make_example()


@pytest.fixture(scope="session")
def small_scene(tmp_path_factory):
    """A scene that every command runs on in a moment, with traffic beside it."""
    pytest.importorskip("bpy")
    from tests.builders.small_scene import save_small_scene  # noqa: PLC0415 -- Blender's module need not be there

    return save_small_scene(tmp_path_factory.mktemp("small"))
