"""Imports point one way, and the core runs where there is no Blender."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BLENDERS_OWN = {"bpy", "bmesh", "mathutils", "addon_utils", "bpy_extras", "gpu", "gpu_extras", "blf", "bl_ext"} | {
    "bl_operators"
}

WITHOUT_BLENDER = """
import importlib, pkgutil, sys

class NoBlender:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {names}:
            raise ModuleNotFoundError("the core asked for " + name)

sys.meta_path.insert(0, NoBlender())
import seip_addon.core as core
names = [module.name for module in pkgutil.walk_packages(core.__path__, "seip_addon.core.")]
for name in names:
    importlib.import_module(name)
assert not {names} & set(sys.modules)
print(len(names))
"""


def modules(folder: str) -> list[Path]:
    return sorted((ROOT / folder).rglob("*.py"))


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imported(path: Path) -> tuple[str, ...]:
    """Full names of what a file imports, wherever in it."""
    return tuple(_imported(path))


def _imported(path: Path) -> Iterator[str]:
    package = path.relative_to(ROOT).parts[:-1]
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            stem = ".".join([*base, *([node.module] if node.module else [])])
            yield from (f"{stem}.{alias.name}" for alias in node.names)


def top(name: str) -> str:
    return name.partition(".")[0]


def test_every_module_of_the_core_loads_without_blender():
    outcome = subprocess.run(  # noqa: S603  # our own interpreter and script
        [sys.executable, "-c", WITHOUT_BLENDER.format(names=BLENDERS_OWN)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        stdin=subprocess.DEVNULL,
    )
    assert outcome.returncode == 0, outcome.stderr
    assert int(outcome.stdout) == len(modules("seip_addon/core")) - 1  # the package itself is not listed


def offenders(folders: list[str], allowed) -> dict[str, set[str]]:
    """What files import beside what they may, by file; ``allowed(path, name)`` says what they may."""
    found = {
        str(path.relative_to(ROOT)): {name for name in imported(path) if not allowed(path, name)}
        for folder in folders
        for path in modules(folder)
    }
    return {path: names for path, names in found.items() if names}


def test_the_core_imports_nothing_above_it():
    """The BVH tree exists in Blender's Python alone; it is imported where such a ray caster is made."""

    def allowed(path, name):
        if top(name) == "seip_addon":
            return name.startswith("seip_addon.core")
        return top(name) not in BLENDERS_OWN | {"headless"} or (path.stem, top(name)) == ("ray_casting", "mathutils")

    assert not offenders(["seip_addon/core"], allowed)


def test_the_bridge_imports_neither_commands_nor_the_panel():
    above = ("headless", "seip_addon.panel", "seip_addon.registration")
    assert not offenders(["seip_addon/scene"], lambda _, name: not name.startswith(above))


LAYERS = ("storage", "geometry", "site", "sensing", "world", "choosing", "output", "workflows")
"""Groups of packages of the core: each imports only those before it."""


def module_name(path):
    """Full name of a module or package."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def circles(uses: dict[str, set[str]]) -> set[str]:
    """Modules that are part of a circle of imports, or between two."""
    while True:
        used = set().union(*uses.values())
        ends = {name for name, names in uses.items() if name not in used or not names & uses.keys()}
        if not ends:
            return set(uses)
        uses = {name: names for name, names in uses.items() if name not in ends}


@cache
def uses() -> dict[str, set[str]]:
    """Modules of the program that each of them imports."""
    there = {module_name(path): path for folder in ("seip_addon", "headless") for path in modules(folder)}
    return {
        name: {one if one in there else one.rpartition(".")[0] for one in imported(path)} & there.keys() - {name}
        for name, path in there.items()
    }


def test_no_modules_import_each_other_in_a_circle_not_even_within_functions():
    assert not circles(uses())
    assert circles(uses() | {"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == {"a", "b", "c"}


def test_the_report_imports_no_solver():
    found, left, reached = uses(), ["headless.report"], set()
    while left:
        name = left.pop()
        reached.add(name)
        left += found[name] - reached
    assert "seip_addon.core.output.report.sections" in reached
    assert not [name for name in reached if name.endswith((".solver", ".bounds", ".visibility.grid"))]


def test_groups_of_the_core_import_only_lower_ones():
    def allowed(path, name):
        own, used = path.relative_to(ROOT / "seip_addon" / "core").parts[0], name.split(".")[2:]
        if not name.startswith("seip_addon.core.") or own not in LAYERS or used[0] not in LAYERS:
            return True
        return LAYERS.index(used[0]) <= LAYERS.index(own)

    assert not offenders(["seip_addon/core"], allowed)


def test_the_add_on_never_names_itself():
    """Installed, it is called `bl_ext.user_default.seip.seip_addon`: only relative imports find it."""
    for path in modules("seip_addon"):
        nodes = list(ast.walk(tree(path)))
        absolute = [node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.level == 0]
        absolute += [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
        assert "seip_addon" not in {top(name) for name in absolute if name}, path


def test_what_is_imported_is_pinned():
    """Torch may be imported by the detector alone, Dask where it is of use; SciPy is for oracles."""
    ours = {
        "contourpy",
        "defusedxml",
        "embreex",
        "fpdf",
        "highspy",
        "matplotlib",
        "numpy",
        "PIL",
        "pulp",
        "shapely",
        "tqdm",
    }
    everywhere = ours | {"seip_addon", "headless"} | set(sys.stdlib_module_names) | BLENDERS_OWN
    by_file = {
        "network_workers.py": {"dask", "distributed"},
        "lock_wheels.py": {"packaging"},
        "extract.py": {"osmium"},
    }

    def allowed(path, name):
        detector = {"torch"} if {"detection"} & set(path.parts) else set()
        return top(name) in everywhere | detector | by_file.get(path.name, set())

    assert not offenders(["seip_addon", "headless"], allowed)


def test_no_product_module_imports_a_study():
    """`headless/study.py` imports a study by the name that its user gives."""

    def allowed(path, name):
        return "studies" in path.parts or not name.startswith("headless.studies")

    assert not offenders(["headless", "seip_addon"], allowed)


def test_an_import_that_points_up_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "ROOT", tmp_path)
    path = tmp_path / "seip_addon" / "core" / "wrong.py"
    path.parent.mkdir(parents=True)
    path.write_text("def f():\n    from ..scene import read\n    from . import site\n    import bpy.types\n")
    assert set(imported(path)) == {"seip_addon.scene.read", "seip_addon.core.site", "bpy.types"}
