"""The Python interface: its examples hold, and each public name is documented."""

import doctest
import inspect
from pathlib import Path

import pytest

pytest.importorskip("bpy", reason="the examples open a scene")

from seip_addon import api

ROOT = Path(__file__).resolve().parents[2]


def test_examples_hold(monkeypatch):
    monkeypatch.chdir(ROOT)
    outcome = doctest.testmod(api)
    assert outcome.attempted
    assert not outcome.failed


@pytest.mark.parametrize("name", api.__all__)
def test_public_names_are_documented(name):
    assert inspect.getdoc(getattr(api, name))
