import signal

import pytest

from seip_addon.scene.interrupts import held_interrupts


def test_ctrl_c_is_raised_when_the_block_ends():
    reached = []

    def interrupted():
        with held_interrupts():
            signal.raise_signal(signal.SIGINT)
            reached.append("the end")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert reached


def test_a_handler_that_is_not_pythons_is_left_alone(monkeypatch):
    given = []
    monkeypatch.setattr(signal, "getsignal", lambda _number: None)  # as in the real Blender
    monkeypatch.setattr(signal, "signal", lambda *arguments: given.append(arguments))
    with held_interrupts():
        pass
    assert not given


def test_the_handler_is_put_back():
    before = signal.getsignal(signal.SIGINT)
    with held_interrupts():
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before
