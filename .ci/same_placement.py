"""End with status 1 where two placement.json differ in more than times and versions, or are not proven optimal."""

import json
import sys

from seip_addon.core.output.results.placement_record import comparable, load_placement


def lines(path: str) -> list[str]:
    """Lines of a record, without what differs from one machine and run to the next."""
    record = load_placement(path)
    if record.objective.status != "optimal":
        sys.exit(f"{path} is not proven optimal, so that it depends on the machine's speed")
    return json.dumps(comparable(record), indent=1, sort_keys=True).splitlines()


one, other = map(lines, sys.argv[1:])
differing = [(left, right) for left, right in zip(one, other, strict=False) if left != right]
if differing or len(one) != len(other):
    sys.exit("\n".join(["the placements differ:", *(f"{left}   |   {right}" for left, right in differing[:20])]))
print(f"{sys.argv[1]} and {sys.argv[2]} hold the same placement")  # noqa: T201  # a check's output
