"""Energy of a day's work: what the battery must hold."""

from dataclasses import dataclass
from typing import Any

from planner.checks.energy import Energy, watt_hours


@dataclass(frozen=True)
class Day:
    """Cycles of a mission in a day. A battery must hold `usable` and give `energy.peak_W`."""

    energy: Energy
    """Of one cycle."""
    cycles: int
    plots: int | None
    """Number of plots in a cycle; None if the mission does not say."""

    @property
    def usable(self) -> float | None:
        """Energy that the battery must be able to give in a day [J]; None if no drive is known."""
        return None if self.energy.drawn is None else self.energy.drawn * self.cycles

    @property
    def per_plot(self) -> float | None:
        """Energy from the supply for each plot, with its share of the road [J]."""
        return None if self.energy.drawn is None or self.plots is None else self.energy.drawn / self.plots

    @property
    def sentences(self) -> tuple[str, ...]:
        """The battery in a sentence; none if no drive is known."""
        if self.usable is None or self.energy.peak_W is None:
            return ()
        plot = "" if self.per_plot is None else f", {watt_hours(self.per_plot)} a plot"
        times = "once" if self.cycles == 1 else f"{self.cycles} times"
        battery = f"a battery of {watt_hours(self.usable)} usable and {self.energy.peak_W:.0f} W"
        return (f"a day, the mission {times}{plot}: {battery}",)

    def to_json(self) -> dict[str, Any]:
        """Return the object of the JSON of `boom require`, in SI."""
        day = {"cycles": self.cycles, "plots": self.plots, "usable_J": self.usable, "per_plot_J": self.per_plot}
        return self.energy.to_json() | {"day": day}
