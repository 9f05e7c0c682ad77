"""What a user reads of a mistake."""

import unicodedata

from seip_addon.core.base.errors import SeipError


def test_a_sentence_that_repeats_a_whole_file_loses_its_middle():
    sentence = str(SeipError(f"map.xodr: road '{50_000 * 'a'}' has no length; give it one"))
    assert sentence.startswith("map.xodr: road 'aaa")
    assert sentence.endswith("has no length; give it one")
    assert 500 < len(sentence) <= 600


def test_control_characters_are_replaced():
    sentence = str(SeipError("road 'a\x1b[31m\x00\x85' has\nno\tlength"))
    assert sentence == "road 'a\N{REPLACEMENT CHARACTER}[31m\N{REPLACEMENT CHARACTER} ' has no length"
    assert not any(unicodedata.category(one) == "Cc" for one in sentence)
