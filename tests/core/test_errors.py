"""What a user reads of a mistake."""

from seip_addon.core.errors import SeipError


def test_a_sentence_that_repeats_a_whole_file_loses_its_middle():
    sentence = str(SeipError(f"map.xodr: road '{50_000 * 'a'}' has no length; give it one"))
    assert sentence.startswith("map.xodr: road 'aaa")
    assert sentence.endswith("has no length; give it one")
    assert len(sentence) < 1100


def test_others_are_as_they_are_written():
    assert str(SeipError("there is no file x; check its name")) == "there is no file x; check its name"
