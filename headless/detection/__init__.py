"""PointPillars, its training and its evaluation; the only code that imports torch."""

import sys
from importlib.util import find_spec

if find_spec("torch") is None:
    sys.exit(
        f"error: {sys.executable} has no package 'torch', which detection needs: run `make detection` "
        "and then this command with .venv/bin/python -m, or pip install '.[detection]' in the project's folder"
    )
