"""Lack of fit: how far the stated uncertainties explain the residuals of a fit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

# Level of the chi-square test above which a fit has a warning.
SIGNIFICANCE = 1e-3

# Root mean squares of weighted residuals above which a fit has failed, far above what is
# significant with any degrees of freedom. Sigma absorbs uncertainties that are stated wrong, by ten
# and more where nobody knew them, as long as residuals look like scatter; with a pattern that
# scatter does not explain, something in the file, the readings or the model is wrong.
LIMIT, LIMIT_OF_SCATTER = 10.0, 100.0


@dataclass(frozen=True)
class LackOfFit:
    """The weighted sum of squares S^2 of a fit's residuals, at the stated uncertainties, with its
    degrees of freedom, the number of flagged readings, and a flag for a significant pattern of the
    residuals, set too if no test was made. `contradicted` are causes that the readings showed
    against assumptions of the experiment.
    """

    sum_of_squares: float
    degrees_of_freedom: int
    suspected: int = 0
    has_pattern: bool = True
    contradicted: tuple[str, ...] = ()

    @property
    def times(self) -> float:
        """S^2 over its degrees of freedom: 1 on average, NaN without any."""
        return self.sum_of_squares / (self.degrees_of_freedom or math.nan)

    @property
    def is_significant(self) -> bool:
        """True if S^2 is larger than the stated uncertainties explain, by a test that errs once in
        a thousand.
        """
        from scipy.special import chdtri

        freedom = self.degrees_of_freedom
        return freedom > 0 and self.sum_of_squares > float(chdtri(freedom, SIGNIFICANCE))

    @property
    def limit(self) -> float:
        """Of the root mean square of weighted residuals."""
        return LIMIT if self.has_pattern else LIMIT_OF_SCATTER

    @property
    def is_beyond_limit(self) -> bool:
        """True if residuals are so large that no result of the fit can be relied on."""
        return self.times > self.limit**2

    @property
    def complaint(self) -> str:
        """Reason for the failure of the fit; possibly empty."""
        if not self.is_beyond_limit:
            return ""
        return (
            f"lack of fit is beyond the limit: residuals are {math.sqrt(self.times):.3g} times as"
            f" large as the stated uncertainties make them (limit {self.limit:g}"
            f" {'with' if self.has_pattern else 'without'} a pattern); find the cause before using"
            " any result"
        )

    @property
    def caveat(self) -> str:
        """Addition to verdicts on results of a failed fit; otherwise empty."""
        if not self.is_beyond_limit:
            return ""
        return ", of which nothing can be relied on: lack of fit is beyond the limit"

    @property
    def caution(self) -> str:
        """The warning that a user of the fit's map needs; empty without one."""
        reasons = []
        if self.is_beyond_limit:
            reasons.append(self.complaint)
        elif self.is_significant:
            reasons.append(f"S^2 is {self.times:.3g} times what the stated uncertainties explain")
        if self.suspected:
            are = "errors are" if self.suspected > 1 else "error is"
            reasons.append(f"{self.suspected} gross {are} suspected among the readings")
        if self.contradicted:
            reasons.append(
                f"the readings contradict the experiment: {'; '.join(self.contradicted)}"
            )
        return f"in the fit of the map, {'; '.join(reasons)}" if reasons else ""


def verdict_of(lack: LackOfFit) -> str:
    """Return the short verdict on a map's fit."""
    if lack.is_beyond_limit:
        return "beyond the limit"
    if lack.is_significant:
        return "significant"
    return "not significant" if lack.degrees_of_freedom > 0 else "not tested"


def verdict_line(lack: LackOfFit, symbol: str = "the map") -> str:
    """The verdict on a map's fit as a line of text."""
    line = f"lack of fit of {symbol}: {verdict_of(lack)}"
    if not lack.degrees_of_freedom:
        return line
    return f"{line} (S^2 is {lack.times:.3g} times what the stated uncertainties explain)"


def verdict_data(lack: LackOfFit) -> dict[str, Any]:
    """The verdict on a map's fit as plain data."""
    return {"verdict": verdict_of(lack), **verdict_content(lack)}


def verdict_content(lack: LackOfFit) -> dict[str, Any]:
    """The entries of a lack of fit, with contradictions if there are any."""
    content = dict(vars(lack))
    causes = content.pop("contradicted")
    return {**content, "contradicted": list(causes)} if causes else content
