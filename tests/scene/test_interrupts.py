"""Signals during Blender's own code."""

import signal

import pytest

from seip_addon.scene.interrupts import held_signals


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_are_delivered_when_the_block_ends(number):
    reached = []

    def held():
        with held_signals():
            signal.raise_signal(number)
            reached.append("the end")

    def stop(_number, _frame):
        raise SystemExit

    before = signal.signal(number, stop)
    try:
        with pytest.raises(SystemExit):
            held()
        assert signal.getsignal(number) is stop
    finally:
        signal.signal(number, before)
    assert reached
