"""Background thread for long work, polled from Blender's event loop."""

import threading
from collections.abc import Generator
from concurrent.futures import CancelledError, Future
from typing import Generic, TypeVar

from ..core.base.progress import Progress, finish

Result = TypeVar("Result")


class Background(Generic[Result]):
    """Runs steps in a thread of its own, from now on.

    Parameters
    ----------
    steps : generator of Progress
        Stopped at its next report, and closed, once somebody asks for that.

    Attributes
    ----------
    progress : Progress
        The last report.
    """

    def __init__(self, steps: Generator[Progress, None, Result]) -> None:
        self.progress = Progress(0, 0, "starting")
        self._stop = threading.Event()
        self._end: Future[Result] = Future()
        self._thread = threading.Thread(target=self._run, args=(steps,), daemon=True)
        self._thread.start()

    @property
    def ended(self) -> bool:
        """Whether there is a result, or an error in its place."""
        return self._end.done()

    def result(self) -> Result:
        """Return the result, or raise what went wrong; waits for the end."""
        return self._end.result()

    def stop(self) -> None:
        """Ask the work to end at its next report, and return at once."""
        self._stop.set()

    def join(self, seconds: float) -> bool:
        """Wait for the thread to end, no longer than some seconds; return whether it did."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _run(self, steps: Generator[Progress, None, Result]) -> None:
        def report(progress: Progress) -> None:
            self.progress = progress
            if self._stop.is_set():
                raise CancelledError

        try:
            result = finish(steps, report)
        except BaseException as error:  # noqa: BLE001  # raised again when the result is read
            self._end.set_exception(error)
        else:
            self._end.set_result(result)
