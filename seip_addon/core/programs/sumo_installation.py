"""Installation of SUMO with pip into a folder of its own, for a Blender without it."""

import re
import shutil
import sys
from collections.abc import Generator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from ..base.errors import SeipError
from ..base.progress import Progress
from ..storage.files import check_folder, unfinished_name
from .child_process import run_logged
from .sumo_programs import Sumo, find_sumo, sumo_version

SUMO_VERSION = "1.28.0"
"""Version that is installed: that of the group ``traffic`` in pyproject.toml."""
BY_HAND = "install Eclipse SUMO yourself and name its folder in the preferences of the extension"

_ERROR = re.compile(r"^ERROR: (.+)$", re.MULTILINE)
DOWNLOAD_SIZE = {"win32": 158, "darwin": 55}.get(sys.platform, 149)
"""Size of its wheel, megabytes."""


def installed_sumo(folder: Path) -> Path:
    """Return where SUMO is in the folder that `install_sumo` was called with."""
    return folder / SUMO_VERSION


def install_sumo(pip: Sequence[str], folder: Path) -> Generator[Progress, None, Sumo]:
    """Install SUMO into a folder with pip, whole or not at all.

    Parameters
    ----------
    pip : sequence of str
        Command that starts pip.
    folder : Path
        Folder for SUMO and nothing else; a SUMO that is there is replaced.

    Yields
    ------
    Progress
        Ten times a second. Closing the generator ends pip and leaves the folder as it was.

    Raises
    ------
    SeipError
        The folder cannot be written, pip fails, or SUMO does not start afterwards.
    """
    check_folder(folder)
    with TemporaryDirectory(prefix=unfinished_name(folder, "sumo-").name, dir=folder) as temporary:
        new, log = Path(temporary) / "sumo", Path(temporary) / "log"
        options = ["--no-deps", "--only-binary", ":all:", "--no-compile", "--no-cache-dir", "--no-input", "-q"]
        command = [*pip, "install", f"eclipse-sumo=={SUMO_VERSION}", "--target", str(new), *options]
        # pip downloads to the folder for temporary files, so that nothing is left if it is ended
        variables = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), temporary)
        working = Progress(0, 0, f"installing SUMO, {DOWNLOAD_SIZE} MB")
        try:
            status = yield from run_logged(command, log, lambda _: working, environment=variables)
        except OSError as error:
            raise SeipError(f"{pip[0]} cannot be started ({error.strerror}): {BY_HAND}") from error
        if status != 0:
            raise SeipError(_failure(log.read_text(encoding="utf-8", errors="replace"), status))
        yield Progress(0, 0, "starting SUMO", counted=False)
        sumo_version(find_sumo([new]))
        for old in folder.iterdir():
            if old.is_dir() and old != Path(temporary):
                shutil.rmtree(old)
        new.replace(installed_sumo(folder))
    return find_sumo([installed_sumo(folder)])


def _failure(output: str, status: int) -> str:
    """Return why pip failed: its last message."""
    reasons = _ERROR.findall(output) or output.strip().splitlines()[-1:]
    reason = reasons[-1].rstrip(".") if reasons else f"pip ended with status {status}"
    return f"SUMO could not be installed ({reason}): check the connection to the internet, or {BY_HAND}"
