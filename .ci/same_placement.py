"""End with status 1 where two placement.json differ in more than times and versions."""

import json
import sys
from pathlib import Path


def comparable(path: str) -> list[str]:
    """Lines of a record, without what differs from one machine and run to the next."""
    record = json.loads(Path(path).read_text(encoding="utf-8"))
    kept = {key: value for key, value in record.items() if key not in {"times", "versions"}}
    return json.dumps(kept, indent=1, sort_keys=True).splitlines()


one, other = map(comparable, sys.argv[1:])
differing = [(left, right) for left, right in zip(one, other, strict=False) if left != right]
if differing or len(one) != len(other):
    sys.exit("\n".join(["the placements differ:", *(f"{left}   |   {right}" for left, right in differing[:20])]))
print(f"{sys.argv[1]} and {sys.argv[2]} hold the same placement")  # noqa: T201  # a check's output
