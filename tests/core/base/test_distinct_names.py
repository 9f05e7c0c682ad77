"""Names of any kind become distinct, and stay what they are where they were."""

from hypothesis import example, given, settings
from hypothesis import strategies as st

from seip_addon.core.base.distinct_names import distinct_names


@given(st.lists(st.one_of(st.from_regex(r"[aAß](-[12])*", fullmatch=True), st.text(max_size=3)), max_size=30))
@example(["A", "A", "A-2"])
@example(["A-2", "A", "a"])
@settings(max_examples=50, deadline=None)
def test_names_become_distinct(names):
    found = distinct_names(names)
    assert len({name.casefold() for name in found}) == len(names)
    first = [name for number, name in enumerate(names) if name.casefold() not in map(str.casefold, names[:number])]
    assert all(other.startswith(name) for name, other in zip(names, found, strict=True))
    if len(first) == len(names):
        assert found == names
