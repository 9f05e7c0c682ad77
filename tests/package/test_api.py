"""The Python interface: each public name is documented."""

import inspect

import pytest

pytest.importorskip("bpy", reason="the examples open a scene")

from seip_addon import api


@pytest.mark.parametrize("name", api.__all__)
def test_public_names_are_documented(name):
    assert inspect.getdoc(getattr(api, name))
