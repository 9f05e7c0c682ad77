"""Handling of signals during Blender's own code."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


@contextmanager
def held_signals() -> Iterator[None]:
    """Hold Ctrl-C and termination back until the block ends, and deliver the first of them then.

    Blender's operators call back into Python. An exception that a signal's handler raises there is printed and
    forgotten, and the run continues, or Blender never ends. Signals that Blender itself has taken keep their handler,
    because Python cannot restore it.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    caught: list[int] = []
    before = {number: signal.getsignal(number) for number in SIGNALS}
    ours = {number: handler for number, handler in before.items() if handler is not None}
    for number in ours:
        signal.signal(number, lambda which, _frame: caught.append(which))
    try:
        yield
    finally:
        for number, handler in ours.items():
            signal.signal(number, handler)
    if caught:
        signal.raise_signal(caught[0])
