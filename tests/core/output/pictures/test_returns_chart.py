"""Chart of returns: its key names the marks of recorded shares without using that of a surface."""

from types import SimpleNamespace

from seip_addon.core.output.pictures import verification
from seip_addon.core.sensing.recordings.figures import ReturnShare


def test_no_other_entry_of_the_key_has_the_mark_of_a_surface(monkeypatch):
    drawn = []
    monkeypatch.setattr(verification, "save_chart", lambda _path, figure, *_others: drawn.append(figure))
    shares = tuple(
        ReturnShare(surface, low, low + 5.0, 100, 0.9, 0.8, 0.7)
        for surface in ("ground", "objects", "road")
        for low in (10.0, 15.0)
    )
    sensor = SimpleNamespace(shares=shares, gain=None, registration=SimpleNamespace(sensor=SimpleNamespace(label="S1")))
    verification.save_returns_chart("unused.png", SimpleNamespace(sensors=[sensor]))
    (figure,) = drawn
    lines, words = figure.axes[0].get_legend_handles_labels()
    marks = dict(zip(words, (line.get_marker() for line in lines), strict=True))
    surfaces = {marks.pop(name) for name in ("ground", "objects", "road")}
    assert len(surfaces) == 3
    assert any("recorded" in name for name in marks)
    assert not surfaces & set(marks.values())
