"""Verdicts on the paper's claims about coverage, for one site."""

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

from headless.studies.claims import FAILS, HOLDS, UNDECIDED, Claim, verdict, worst_verdict

from .cells import CENTRAL_WEIGHTS, COUNTS, Case, CoverageStudy, Span

MIN_CHANGE = 0.01  # share of the region below which a gain or loss of coverage is negligible

# Coverages are spans, from the least to the largest possible value, as the solver may not have proven the optimum. A
# claim holds if all values in the spans agree with it, fails if none does, and is undecided otherwise.


def coverage_claims(study: CoverageStudy) -> tuple[Claim, ...]:
    """Evaluate claims 1 to 4 and 10 of the paper on the solved cells, in ascending order.

    Claims that compare types, heights or weights are left out if there is nothing to compare.
    """
    claims = [_four_of_the_best(study), _greedy(study)]
    if len(study.sensors) > 1:
        claims.append(_more_is_better(study))
        if len(study.heights) > 1:
            claims.append(_heights(study))
        if any(cell.weight != 1 for cell in study.cells):
            claims.append(_weighting(study))
    return tuple(sorted(claims, key=lambda claim: claim.number))


def _more_is_better(study: CoverageStudy) -> Claim:
    """Evaluate claim 1: coverage rises with the number of sensors and with a better type."""
    best, (few, most) = study.sensors[-1], COUNTS[-2:]
    shares = {(sensor, n): study.possible(sensor, n) for sensor in study.sensors for n in COUNTS}
    verdicts = [
        _rises(shares[sensor, b], shares[sensor, a]) for sensor in study.sensors[:-1] for a, b in pairwise(COUNTS)
    ]
    verdicts += [_rises(shares[b, n], shares[a, n]) for a, b in pairwise(study.sensors) for n in COUNTS]
    gain = _gain(shares[best, most], shares[best, few])
    verdicts.append(UNDECIDED if gain is None else verdict(holds=gain[1] < MIN_CHANGE, fails=gain[0] >= MIN_CHANGE))
    rows = [f"{sensor} " + ", ".join(_percentage(shares[sensor, n]) for n in COUNTS) for sensor in study.sensors]
    gained = "" if gain is None else f"; {best} gains {_range(gain)} from N = {few} to {most}"
    return Claim(
        1,
        f"coverage rises with N and with a better type; for {best} the gain is negligible",
        worst_verdict(verdicts),
        f"N = {', '.join(map(str, COUNTS))}: {'; '.join(rows)}{gained}",
    )


def _four_of_the_best(study: CoverageStudy) -> Claim:
    """Evaluate claim 2: the largest number of sensors of the best type covers all, and fewer are enough."""
    best, most = study.sensors[-1], COUNTS[-1]
    text = f"four {best} sensors see 100 %, and fewer would do"
    case, share = study.find(best, most), study.possible(best, most)
    if case is None or share is None:
        return Claim(2, text, UNDECIDED, f"there is no placement of {most} {best} sensors")
    used = len(case.placement.chosen)
    spare = used < most or any(_is_full(study.possible(best, n)) for n in COUNTS[:-1])
    # All sensors in use means that all are needed only if ties were broken; a note reports if they were not.
    settled = case.placement.status == "optimal" and not case.placement.notes
    return Claim(
        2,
        text,
        worst_verdict([verdict(holds=_is_full(share), fails=share[1] < 1), verdict(holds=spare, fails=settled)]),
        f"{_percentage(share)} with {used} of {most} sensors used",
    )


def _heights(study: CoverageStudy) -> Claim:
    """Evaluate claim 3: the first type is best at the lowest height, the other types at a higher one."""
    lowest, *higher = study.heights
    verdicts, rows = [], []
    for sensor in study.sensors:
        named = []
        for n in COUNTS:
            shares = {h: study.possible(sensor, n, h) for h in study.heights}
            named.append(_best_heights(shares))
            if sensor == study.sensors[0]:
                verdicts += [_exceeds(shares[lowest], shares[h]) for h in higher]
            else:
                verdicts.append(_exceeds(_best([shares[h] for h in higher]), shares[lowest]))
        rows.append(f"{sensor} {', '.join(named)}")
    return Claim(
        3,
        f"{study.sensors[0]} does best at {lowest:g} m; the other types prefer higher, at every N",
        worst_verdict(verdicts),
        f"best height at N = {', '.join(map(str, COUNTS))}: {'; '.join(rows)}",
    )


def _weighting(study: CoverageStudy) -> Claim:
    """Evaluate claim 4: weighting central targets raises their coverage without a loss on the whole."""
    verdicts, rows = [], []
    for sensor in study.sensors:
        plain = study.find(sensor, COUNTS[-1])
        weighted = [study.find(sensor, COUNTS[-1], weight=w) for w in CENTRAL_WEIGHTS]
        cases = [case for case in weighted if case is not None]
        if plain is None or not cases:
            verdicts.append(UNDECIDED)
            rows.append(f"{sensor}: no placement")
            continue
        changes = [_change(plain, case) for case in cases]
        # the largest gain in the centre among the weights without a loss on the whole; among all if each has a loss
        cheap = [change for change in changes if change[1] > -MIN_CHANGE]
        gain, loss = max(cheap or changes)
        central, whole = _views(plain)
        costly = "" if cheap else ", the largest gain: every weight costs more"
        rows.append(f"{sensor}: central {central:.1%} {gain:+.2%}, whole {whole:.1%} {loss:+.2%}{costly}")
        proven = [_is_proven(plain) and case is not None and _is_proven(case) for case in weighted]
        verdicts.append(_weighting_verdict(changes, proven, is_best=sensor == study.sensors[-1]))
    return Claim(
        4,
        "weighting raises central coverage of all but the best type without hurting the whole; the best gains nothing",
        worst_verdict(verdicts),
        f"N = {COUNTS[-1]}, best weight that costs the whole under {MIN_CHANGE:.0%}: {'; '.join(rows)}; where several "
        "placements are best, the figures are those of the one returned",
    )


def _weighting_verdict(changes: Sequence[tuple[float, float]], proven: Sequence[bool], *, is_best: bool) -> str:
    """Return the verdict on one type by its gains and losses; undecided unless all its placements are proven."""
    if not all(proven):
        return UNDECIDED
    if is_best:
        return HOLDS if all(gain < MIN_CHANGE for gain, _ in changes) else FAILS
    return HOLDS if any(gain >= MIN_CHANGE and loss > -MIN_CHANGE for gain, loss in changes) else FAILS


def _change(plain: Case, weighted: Case) -> tuple[float, float]:
    """Return the changes of central and of whole coverage by weighting."""
    (central, whole), (central_after, whole_after) = _views(plain), _views(weighted)
    return central_after - central, whole_after - whole


def _views(case: Case) -> tuple[float, float]:
    """Return the coverage of the central targets and of all."""
    return case.deployment.central or 0.0, case.deployment.coverage


def _is_proven(case: Case) -> bool:
    return case.placement.status == "optimal"


def _greedy(study: CoverageStudy) -> Claim:
    """Evaluate claim 10: the greedy algorithm reaches its guarantee (Nemhauser, Wolsey and Fisher 1978)."""
    guarantee = 1 - 1 / math.e
    reached = [(case.greedy.objective, *case.span) for case in study.cases]
    verdicts = [verdict(holds=value >= guarantee * high, fails=value < guarantee * low) for value, low, high in reached]
    worst = min(value / high for value, _, high in reached)
    short = sum(value < low * (1 - 1e-9) for value, low, _ in reached)
    return Claim(
        10,
        "greedy reaches 1 − 1/e of the optimum",
        worst_verdict(verdicts),
        f"at worst {worst:.1%} of the bound; below the integer program in {short} of {len(reached)} cells",
    )


def _rises(more: Span | None, less: Span | None) -> str:
    """Return the verdict on a non-negligible rise of coverage; it also holds if nearly all was covered before."""
    if more is None or less is None:
        return UNDECIDED
    full = 1 - MIN_CHANGE
    return verdict(
        holds=more[0] - less[1] > MIN_CHANGE or less[0] >= full,
        fails=more[1] - less[0] <= MIN_CHANGE and less[1] < full,
    )


def _exceeds(more: Span | None, less: Span | None) -> str:
    """Return the verdict on one coverage being above another."""
    if more is None or less is None:
        return UNDECIDED
    return verdict(holds=more[0] > less[1], fails=more[1] <= less[0])


def _is_full(span: Span | None) -> bool:
    return span is not None and span[0] >= 1


def _gain(more: Span | None, less: Span | None) -> Span | None:
    """Return the least and largest possible gain; an additional sensor never reduces coverage."""
    if more is None or less is None:
        return None
    return max(0.0, more[0] - less[1]), more[1] - less[0]


def _best(spans: Iterable[Span | None]) -> Span | None:
    """Return the span of the maximum of several, or None if one of them is missing."""
    known = []
    for span in spans:
        if span is None:
            return None
        known.append(span)
    return max(low for low, _ in known), max(high for _, high in known)


def _best_heights(shares: Mapping[float, Span | None]) -> str:
    """Describe the height with the largest coverage, or the heights that are tied."""
    coverages = {height: span[0] for height, span in shares.items() if span is not None}
    if not coverages:
        return "no placement"
    best = [f"{height:g}" for height, coverage in coverages.items() if coverage == max(coverages.values())]
    return f"{best[0]} m" if len(best) == 1 else f"{'/'.join(best)} m (a tie)"


def _percentage(span: Span | None) -> str:
    return "no placement" if span is None else f"{span[0]:.1%}"


def _range(span: Span) -> str:
    low, high = (f"{value:.2%}" for value in span)
    return low if low == high else f"{low} to {high}"
