"""The small junction as a file, shared by the tests of all commands."""

import pytest


@pytest.fixture(scope="session")
def small_scene(tmp_path_factory):
    """A scene that every command runs on in a moment, with traffic beside it."""
    from small_scene import save_small_scene  # noqa: PLC0415 -- Blender's module need not be there

    return save_small_scene(tmp_path_factory.mktemp("small"))
