"""The trust region and how it changes: within the search for one design, and from design to design."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pneumorph.optimize.settings import RadiusSettings


@dataclass(frozen=True)
class TrustRegion:
    """The trust region during the search for the next design; sizes in reference steps.

    Attributes
    ----------
    radius : float
    first : float
        The radius at the beginning of the search.
    longest : float
        To which it may still grow in this search: less once a region was too large, nothing after a trial.
    trials : int
        Number of designs that were analysed.
    """

    radius: float
    first: float
    longest: float
    trials: int = 0

    def exhausted(self, settings: RadiusSettings) -> bool:
        """Whether it is too small for another step."""
        return self.radius < settings.smallest

    def after_trial(self) -> TrustRegion:
        """The same after one more trial."""
        return replace(self, longest=0.0, trials=self.trials + 1)

    def rejected(self, factor: float) -> TrustRegion:
        """The region after a rejected trial."""
        return replace(self, radius=factor * self.radius)

    def too_large(self, settings: RadiusSettings) -> TrustRegion:
        """The region after one in which no step could be proposed."""
        radius = settings.shrink * self.radius
        return replace(self, radius=radius, longest=radius)

    def longer(self, settings: RadiusSettings) -> TrustRegion:
        """A larger region, where the objective may change more."""
        return replace(self, radius=min(settings.expand * self.radius, self.longest))


def begin(settings: RadiusSettings, radius: float, stride: float) -> TrustRegion:
    """The region at the beginning of a search, where states are predicted as far as `stride` at once."""
    return TrustRegion(radius, radius, largest(settings, stride))


def largest(settings: RadiusSettings, stride: float) -> float:
    """The largest region where states are predicted as far as `stride` at once."""
    return max(settings.largest, stride)


def next_radius(
    settings: RadiusSettings, region: TrustRegion, ratio: float, kept: float, long: bool, stride: float
) -> float:
    """The radius for the next design, in reference steps, after a step was accepted.

    A region in which a step was just rejected does not grow: there it would be too large again, and where no
    equilibrium is found a trial costs as much as several designs.

    Parameters
    ----------
    region : in which the step was found.
    ratio : of actual to predicted gain.
    kept : the share of its predicted gain that the step kept when it was brought within the limits.
    long : whether the step was long enough to show that the region is too small.
    stride : how far states are predicted at once, in reference steps.
    """
    radius, at_once = region.radius, region.trials == 1
    if ratio < settings.fair or kept < settings.poorly_kept:
        radius *= settings.shrink
    elif ratio > settings.good and kept > settings.well_kept and long and at_once:
        radius *= settings.expand
    if ratio >= settings.fair and at_once:
        radius = max(radius, min(settings.expand * region.first, settings.ordinary))
    return min(max(radius, settings.smallest), largest(settings, stride))
