"""Binomial proportions with confidence intervals."""

from __future__ import annotations

import math
from dataclasses import dataclass

from seip_addon.core.estimates import NORMAL_QUANTILE


@dataclass(frozen=True)
class Share:
    """A number of successes among independent trials."""

    count: int
    trials: int

    @property
    def value(self) -> float:
        """The share, 0 to 1."""
        return self.count / self.trials

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the probability by the score test (Wilson 1927), valid for zero successes, too."""
        n, p, z = self.trials, self.value, NORMAL_QUANTILE
        middle = (p + z**2 / (2 * n)) / (1 + z**2 / n)
        reach = z / (1 + z**2 / n) * math.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
        low = 0.0 if self.count == 0 else max(0.0, middle - reach)
        return low, 1.0 if self.count == n else min(1.0, middle + reach)

    @property
    def per_million(self) -> str:
        """The share of a million, with its interval."""
        low, high = self.interval
        return f"{self.value * 1e6:,.0f} per million [{low * 1e6:,.0f}, {high * 1e6:,.0f}]"

    def __add__(self, other: Share) -> Share:
        """Join the trials of both."""
        return Share(self.count + other.count, self.trials + other.trials)
