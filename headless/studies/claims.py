"""Claims of the paper, and their verdicts on one site.

The claims are those of Qu, Huang and Suo, "SEIP: Simulation-based Design and
Evaluation of Infrastructure-based Collective Perception", section V.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass

from headless.studies.markdown import table

from seip_addon.core.base.estimates import Interval
from seip_addon.core.storage.files import whole_file

HOLDS, FAILS, UNDECIDED = "holds", "does not hold", "undecided"


@dataclass(frozen=True)
class Claim:
    """A claim of the paper with its verdict on one site.

    Parameters
    ----------
    number : int
        Number in the paper's list of claims.
    verdict : str
        ``holds``, ``does not hold``, or ``undecided`` if bounds or intervals leave it open.
    evidence : str
        Figures behind the verdict.
    """

    number: int
    text: str
    verdict: str
    evidence: str

    def describe(self) -> str:
        """Return claim, verdict and figures in one line."""
        return f"claim {self.number} ({self.text}): {self.verdict.upper()}; {self.evidence}"


def verdict(*, holds: bool, fails: bool) -> str:
    """Return the verdict: known to hold, known to fail, or undecided."""
    if holds:
        return HOLDS
    return FAILS if fails else UNDECIDED


def verdict_above(interval: Interval, least: float = 0.0) -> str:
    """Return the verdict on a figure that is claimed to be above ``least``, by its 95 % interval."""
    low, high = interval
    return verdict(holds=low > least, fails=high <= least)


def verdict_within(interval: Interval, least: float, most: float) -> str:
    """Return the verdict on a figure that is claimed to be between two values, by its 95 % interval."""
    low, high = interval
    return verdict(holds=least <= low and high <= most, fails=high < least or low > most)


def worst_verdict(verdicts: Sequence[str]) -> str:
    """Return the verdict on several claims at once: the worst."""
    return next((verdict for verdict in (FAILS, UNDECIDED) if verdict in verdicts), HOLDS)


def save_claims(path: str | os.PathLike[str], claims: Sequence[Claim], title: str) -> None:
    """Write claims with their verdicts and figures as a Markdown table."""
    rows = [(f"{claim.number}", claim.text, f"**{claim.verdict}**", claim.evidence) for claim in claims]
    text = f"# {title}: claims of the study on this site\n\n{table(('#', 'claim', 'verdict', 'figures'), rows)}\n"
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
