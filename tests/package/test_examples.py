"""Modules that many others import show their use: by an example that holds, or by the name of a test."""

import ast
import doctest
import importlib
import re
from collections import Counter
from pathlib import Path

import pytest

pytest.importorskip("bpy", reason="modules of the add-on import it")

ROOT = Path(__file__).resolve().parents[2]
MANY = 10  # modules that import another, from which on it shows its use
SOURCES = [path for folder in ("seip_addon", "headless") for path in (ROOT / folder).rglob("*.py")]
PRODUCT = [path for path in SOURCES if "studies" not in path.parts]


def name_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


def imported(path: Path) -> set[str]:
    """Full names of the modules that a file may import from, and of what it imports from them."""
    package = name_of(path).split(".")[:-1]
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            names |= {module, *(f"{module}.{alias.name}" for alias in node.names)}
    return names


def shared() -> list[str]:
    """Names of the modules that many others import."""
    names = {name_of(path) for path in PRODUCT}
    importers = Counter(name for path in PRODUCT for name in imported(path) & names)
    return sorted(name for name, number in importers.items() if number >= MANY)


def with_examples() -> list[object]:
    """Names of the modules with examples; those of the interface place sensors, which takes a while."""
    names = sorted(name_of(path) for path in PRODUCT if ">>> " in path.read_text(encoding="utf-8"))
    return [pytest.param(name, marks=pytest.mark.slow) if name == "seip_addon.api" else name for name in names]


@pytest.mark.parametrize("name", with_examples())
def test_the_examples_of_a_module_hold(name, monkeypatch, tmp_path):
    if name.startswith("headless.detection"):
        pytest.importorskip("torch", reason="torch is not installed: make detection")
    module = importlib.import_module(name)
    monkeypatch.chdir(ROOT if name == "seip_addon.api" else tmp_path)
    outcome = doctest.testmod(module)
    assert outcome.attempted
    assert not outcome.failed


@pytest.mark.parametrize("name", shared())
def test_a_module_that_many_import_shows_its_use(name):
    text = ROOT.joinpath(*name.split(".")).with_suffix(".py").read_text(encoding="utf-8")
    tests = re.findall(r"`(tests/[\w/]+\.py)`", ast.get_docstring(ast.parse(text)) or "")
    assert ">>> " in text or tests, "give an example, or name a test in the module's docstring"
    assert all((ROOT / test).is_file() for test in tests)
