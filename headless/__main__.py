"""The command ``seip``: each batch command is one of its verbs, as in ``seip place site.blend --count 4 -o out``.

In a checkout ``python -m headless`` is the same command.
"""

import runpy
import sys
from collections.abc import Mapping

from headless.process_end import end_on_signals

VERBS = {
    "build-scene": "build a scene from OpenStreetMap or an OpenDRIVE map",
    "place": "choose the sensors of a scene",
    "network": "spread one budget over the junctions of a network",
    "report": "write a report on a placement, HTML and PDF",
    "traffic": "add traffic to a scene, recorded or simulated by SUMO",
    "simulate": "scan traffic with the sensors of a scene",
    "detect": "detect road users in simulated scans or in a recording",
    "verify": "compare installed sensors with their plan, by a recording",
    "study": "run a study of the program's methods",
}


def main() -> None:
    """Run the command that the first argument names, with the arguments after it."""
    end_on_signals()
    request = sys.argv[1] if len(sys.argv) > 1 else "--help"
    if request in {"-h", "--help"}:
        sys.stdout.write(f"{usage('seip COMMAND', 'Choose and evaluate roadside LiDAR sensors.', VERBS)}\n")
        return
    if request not in VERBS:
        sys.exit(f"error: there is no command {request!r}: seip --help lists the commands")
    del sys.argv[1]
    runpy.run_module(f"headless.{request.replace('-', '_')}", run_name="__main__", alter_sys=True)


def usage(command: str, about: str, names: Mapping[str, str]) -> str:
    """Return the help of a command whose first argument is one of several names."""
    width = max(map(len, names))
    lines = "\n".join(f"  {name:{width}}  {what}" for name, what in names.items())
    return f"usage: {command} [options]    ({command} --help lists them)\n\n{about}\n\n{lines}"


if __name__ == "__main__":
    main()
