"""Options that earlier versions had."""

from headless import removed
from headless.options import new_parser

import pytest

from seip_addon.core.base.errors import SeipError


@pytest.mark.parametrize(
    ("typed", "gone"),
    [
        (["--old"], "--old"),
        (["--old=3"], "--old"),
        (["--kind", "good", "bad"], "--kind bad"),
        (["--kind=bad"], "--kind bad"),
        (["--kind", "good"], None),
        (["old", "--count", "4"], None),
    ],
)
def test_removed_options_name_what_replaces_them(monkeypatch, typed, gone):
    monkeypatch.setattr(removed, "REMOVED", {"--old": "use --new", "--kind bad": "use --kind good", "--count": "never"})
    parser = new_parser("place", "")
    parser.add_argument("words", nargs="*")
    parser.add_argument("--kind", nargs="+", choices=("good",))
    parser.add_argument("--count")
    if gone is None:
        parser.parse_args(typed)
        return
    with pytest.raises(SeipError, match=f"{gone} is no longer an option: use"):
        parser.parse_args(typed)
