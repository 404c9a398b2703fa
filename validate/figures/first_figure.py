"""Figure of a report's first page: the straightened photo, level and error on one axis, and a section."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sealtwin.core.arrays import Pixels
from sealtwin.core.records import Floats, Outline, Profile, Solid, Trajectory, unit
from sealtwin.core.scan_figures import Scan
from validate.figures.particles import draw_solid_across, plane_at
from validate.figures.theme import (
    DEVIATIONS,
    INK,
    MEASURED,
    MUTED,
    ON_GROUND,
    SIMULATED,
    draw_band,
    draw_face,
    draw_ground,
    themed,
)
from validate.metrics.curve_distances import level_difference
from validate.result import Comparison, PredictedLevel, SeedRuns
from validate.run_facts import levels_in_words
from validate.units import signed


@dataclass(frozen=True)
class FirstLayout:
    """Sizes in inches of the first figure for one width of the page. They were chosen by eye."""

    width: float
    left: float  # Room for the labels of the level's axis
    right: float  # Room for notes and the section
    font_pt: float
    whole_titles: bool  # False if there is no room for the explanatory part of a title
    level: tuple[float, float] = (1.9, 2.9)  # Smallest and largest height of the panel with the level
    strip: float = 1.0  # Largest height of the photo
    error: float = 0.85
    gap: float = 0.42  # Space between two rows, for their titles
    foot: float = 0.5

    @property
    def along(self) -> float:
        return self.width - self.left - self.right


WIDE = FirstLayout(width=11.2, left=0.6, right=2.1, font_pt=11.0, whole_titles=True)
NARROW = FirstLayout(width=4.4, left=0.55, right=0.15, font_pt=9.5, whole_titles=False)
HEADROOM_MM, BELOW_FLOOR_MM = 1.5, 1.5  # Heights shown above the highest level or reading, and below the floor
BAND_READ, BAND_NEXT = "error of the readings, 19 of 20", "one further run, 19 of 20 places"
"""Labels of two 95 % bands: of all readings together, and of a run with another seed. They avoid the word "band", which
is easily taken for a tolerance."""
LABELLED_MM = 0.5  # Smallest error that is labelled with its number
MOST_SHOWN = 0.98  # Quantile of the deviations at which their colours end
MANY = 40  # Number of stations above which dots and bars would touch, and the readings are a line
NEAR_END = 0.06  # Fraction of the length at each end in which a label is beside its position
OBLIQUE = 0.3  # Largest offset of a drawn wall point along the crack, divided by its offset across the crack
ONE_TO_ONE = 1.05  # Heights and lengths get the same scale if their scales differ by less than this factor


@dataclass(frozen=True)
class FirstFigure:
    """The parts of a trial that the first figure shows."""

    outline: Outline
    solid: Solid
    trajectory: Trajectory
    profile: Profile
    straight: Pixels  # The photo along the crack, (height, width, 3)
    readings: Profile | None
    comparison: Comparison | None
    prediction: PredictedLevel | None = None
    seeds: SeedRuns | None = None

    def stretch(self, layout: FirstLayout) -> float:
        """Return the scale of heights and widths divided by the scale of lengths. Returns 1 if both have one scale."""
        inch_per_mm = layout.along / self.outline.length_mm
        height = float(np.diff(self._ends_mm)[0]) * inch_per_mm
        factor = float(np.clip(height, *layout.level)) / height
        return 1.0 if 1 / ONE_TO_ONE < factor < ONE_TO_ONE else factor

    @property
    def _ends_mm(self) -> tuple[float, float]:
        """Lower and upper end of the level's axis in mm."""
        shown = [self.profile.level_mm]
        if self.readings is not None:
            shown.append(self.readings.level_mm)
        if self.prediction is not None:
            shown.append(self.prediction.level_mm + self.prediction.profile_band_95_mm)
        if self.seeds is not None:
            shown.append(self.profile.level_mm + self.seeds.band_95_mm)
        return -self.solid.depth_mm - BELOW_FLOOR_MM, float(np.concatenate(shown).max(initial=0.0)) + HEADROOM_MM

    @themed()
    def draw(self, layout: FirstLayout = WIDE) -> Figure:
        """Draw the figure in a layout. The error needs readings, and the section needs a wide layout."""
        length_mm = self.outline.length_mm
        inch_per_mm = layout.along / length_mm * self.stretch(layout)
        half_mm = self.straight.shape[0] * length_mm / (self.straight.shape[1] - 1) / 2
        strip_mm = min(half_mm, layout.strip / inch_per_mm / 2)
        scan = None if self.readings is None else self.readings.scan
        strips = 1 if scan is None else 2
        heights = [2 * strip_mm * inch_per_mm] * strips + [float(np.diff(self._ends_mm)[0]) * inch_per_mm]
        if self.comparison is not None and self.readings is not None:
            heights.append(layout.error)
        width, total = layout.width, sum(heights) + layout.gap * len(heights) + layout.foot
        figure = Figure(figsize=(width, total))
        rows: Any = figure.add_gridspec(
            len(heights),
            1,
            height_ratios=heights,
            left=layout.left / width,
            right=(layout.left + layout.along) / width,
            bottom=layout.foot / total,
            top=1 - layout.gap / total,
            hspace=layout.gap / np.mean(heights),
        ).subplots(sharex=True)
        self._draw_photo(rows[0], half_mm, layout)
        if scan is not None:
            self._draw_deviation(rows[1], scan, half_mm, layout)
        for strip in rows[:strips]:
            strip.set_ylim(-strip_mm, strip_mm)
            strip.set_yticks([-round(strip_mm / 2), 0, round(strip_mm / 2)])
            strip.grid(visible=False)
        self._draw_level(rows[strips], layout)
        if self.comparison is not None and self.readings is not None:
            self._draw_error(rows[strips + 1], self.readings, self.comparison, layout)
        for row in rows:
            row.tick_params(labelsize=layout.font_pt)
        ticks = np.append(_tens(length_mm), length_mm)
        rows[-1].set_xlim(0.0, length_mm)
        rows[-1].set_xticks(ticks, [f"{tick:.4g}" for tick in np.round(ticks, 1)])
        rows[-1].set_xlabel("distance along the crack from its start (mm)", fontsize=layout.font_pt)
        if layout.right > 1:
            level, section_in = rows[strips].get_position(), layout.right - 0.45
            box = (1 - (section_in + 0.1) / width, level.y0, section_in / width, level.height)
            self._draw_section(figure.add_axes(box), section_in / inch_per_mm, layout)
        return figure

    def _draw_photo(self, axes: Axes, half_mm: float, layout: FirstLayout) -> None:
        """Draw the straightened photo, ``half_mm`` on each side, with the walls and the nozzle's path."""
        outline = self.outline
        axes.imshow(
            self.straight,
            extent=(0.0, outline.length_mm, -half_mm, half_mm),
            aspect="auto",
            interpolation="antialiased",
        )
        ahead = unit(np.gradient(outline.centreline_mm, axis=0))
        for wall_mm in (outline.left_wall_mm, outline.right_wall_mm):
            offset = wall_mm - outline.centreline_mm
            along_mm, away_mm = (offset * ahead).sum(axis=1), (offset[:, ::-1] * ahead * (1, -1)).sum(axis=1)
            # At an oblique open end a wall's points are on the edge of the face, not across from the centreline.
            away_mm = np.where(np.abs(along_mm) < OBLIQUE * np.abs(away_mm), away_mm, np.nan)
            for colour, width in (("white", 2.2), (ON_GROUND, 1.1)):
                axes.plot(outline.s_mm, away_mm, color=colour, linewidth=width)
        pour_s_mm = self.trajectory.s_mm[self.trajectory.giving]
        if len(pour_s_mm):
            arrow = {"arrowstyle": "-|>", "color": "white", "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0}
            axes.plot(pour_s_mm[0], 0.0, "o", color="white", markersize=4.5, markerfacecolor="none")
            axes.annotate("", (pour_s_mm[-1], 0.0), (pour_s_mm[0], 0.0), arrowprops=arrow)
        _title(axes, "Crack from above, straightened, mm", "; arrow: nozzle's direction", layout)

    def _draw_deviation(self, axes: Axes, scan: Scan, half_mm: float, layout: FirstLayout) -> None:
        """Draw the simulated minus the scanned height over the photo in grey. Holes of the scan show the photo."""
        grey = self.straight.mean(axis=2) / 255
        length_mm = self.outline.length_mm
        axes.imshow(grey, cmap="gray", vmin=0, vmax=1, extent=(0.0, length_mm, -half_mm, half_mm), aspect="auto")
        deviation_mm = scan.deviation_mm(self.profile.level_at_mm(scan.s_mm))
        most_mm = float(np.nanquantile(np.abs(deviation_mm), MOST_SHOWN)) if np.isfinite(deviation_mm).any() else 1.0
        most_mm = max(np.ceil(2 * most_mm) / 2, 0.5)
        picture = axes.imshow(
            deviation_mm,
            cmap=DEVIATIONS,
            vmin=-most_mm,
            vmax=most_mm,
            alpha=0.85,
            extent=(0.0, length_mm, scan.across_mm[0], scan.across_mm[-1]),
            origin="lower",
            aspect="auto",
        )
        scale = axes.inset_axes((1.02, 0.0, 0.012, 1.0) if layout.right > 1 else (0.55, 1.12, 0.42, 0.1))
        axes.figure.colorbar(
            picture,
            cax=scale,
            orientation="vertical" if layout.right > 1 else "horizontal",
            ticks=[-most_mm, 0.0, most_mm],
        )
        scale.tick_params(labelsize=layout.font_pt, length=2)
        _title(axes, "Simulated minus scanned, mm", "; red: simulated too high, photo: not scanned", layout)

    def _draw_level(self, axes: Axes, layout: FirstLayout) -> None:
        profile, readings, prediction, seeds = self.profile, self.readings, self.prediction, self.seeds
        low_mm, high_mm = self._ends_mm
        s_mm, floor_mm = profile.s_mm, -self.solid.depth_at_mm(profile.s_mm)
        filled_mm = np.maximum(profile.level_mm, floor_mm)
        axes.fill_between(s_mm, floor_mm, filled_mm, color=SIMULATED, alpha=0.15, linewidth=0)
        draw_face(axes)
        if prediction is not None:
            curve, whole = (prediction.s_mm, prediction.level_mm), levels_in_words(seeds, "simulated level")
            draw_band(axes, *curve, prediction.profile_band_95_mm, MUTED, 0.28, f"19 of 20 {whole}")
            draw_band(axes, *curve, prediction.band_95_mm, SIMULATED, 0.3, "19 of 20 at one place")
        if readings is not None:
            if self.comparison is not None and self.comparison.uncertainty is not None:
                bands, read_mm = self.comparison.uncertainty.levels, readings.level_mm
                draw_band(axes, bands.s_mm, read_mm, bands.profile_band_95_mm, MUTED, 0.28, BAND_READ)
                if len(read_mm) <= MANY:
                    bars = {"fmt": "none", "ecolor": MEASURED, "elinewidth": 1.1, "capsize": 2.5}
                    axes.errorbar(bands.s_mm, read_mm, bands.band_95_mm, **bars)
            name = "readings" if readings.scan is None else "scan"
            name += "" if readings.data == "measured" else f" ({readings.data})"
            size = 5.0 if len(readings.s_mm) <= MANY else 2.0
            axes.plot(readings.s_mm, readings.level_mm, "o", color=MEASURED, markersize=size, label=name)
        if seeds is not None and prediction is None:
            draw_band(axes, s_mm, profile.level_mm, seeds.band_95_mm, SIMULATED, 0.3, BAND_NEXT)
        # Drawn over the bands, since no level is below the floor.
        draw_ground(axes, s_mm, floor_mm, low_mm)
        kind = "simulated" if prediction is None else "predicted"
        kind += "" if seeds is None else f", mean of {len(seeds.seeds)} runs"
        axes.plot(s_mm, profile.level_mm, color=SIMULATED, linewidth=2.0, label=kind)
        axes.set_ylim(low_mm, high_mm)
        _title(axes, "Level, mm from the face", " of the sample (0)", layout)
        axes.legend(loc="lower right", fontsize=layout.font_pt, frameon=True, framealpha=0.85, edgecolor="none")

    def _draw_error(self, axes: Axes, readings: Profile, comparison: Comparison, layout: FirstLayout) -> None:
        """Draw the error along the crack in a pale colour, a bar at each compared station, and the readings' band."""
        error, length_mm = level_difference(self.profile, readings), self.outline.length_mm
        if comparison.uncertainty is not None:
            bands = comparison.uncertainty.levels
            draw_band(axes, bands.s_mm, 0.0, bands.profile_band_95_mm, MUTED, 0.28)
        axes.fill_between(error.x, 0.0, error.value, color=SIMULATED, alpha=0.3, linewidth=0)
        are_few = len(comparison.stations.s_mm) <= MANY
        if are_few:
            axes.bar(comparison.stations.s_mm, comparison.stations.error_mm, 0.011 * length_mm, color=INK)
        draw_face(axes)
        # The largest error is inside, with its number.
        most_mm = max(1.0, 2.0 * float(np.abs(error.value).max()))
        axes.set_ylim(-most_mm, most_mm)
        for worst in {int(np.argmax(error.value)), int(np.argmin(error.value))}:
            value, along = float(error.value[worst]), float(error.x[worst]) / length_mm
            if abs(value) >= LABELLED_MM:
                # Inside the plot, also at its ends.
                side = "left" if along < NEAR_END else "right" if along > 1 - NEAR_END else "center"
                above, shift = ("bottom", 4) if value > 0 else ("top", -4)
                axes.annotate(
                    f"{signed(value, 1)} mm",
                    (error.x[worst], value),
                    (0, shift),
                    textcoords="offset points",
                    ha=side,
                    va=above,
                    fontsize=layout.font_pt,
                    fontweight="bold",
                    annotation_clip=False,
                )
        solid = "; solid at a reading" if are_few else ""
        _title(axes, "Error: simulated minus read, mm", f"{solid}; above 0 too high", layout)

    def _draw_section(self, axes: Axes, shown_mm: float, layout: FirstLayout) -> None:
        """Draw the section across the middle of the crack, filled to the level there, in the scale of the level.

        The view is along the path, so its left is at the left of the picture.
        """
        s_mm = self.outline.length_mm / 2
        level_mm = min(0.0, float(np.interp(s_mm, self.profile.s_mm, self.profile.level_mm)))
        axes.axhspan(-self.solid.depth_mm, level_mm, color=SIMULATED, alpha=0.25, linewidth=0)
        axes.axhline(level_mm, color=SIMULATED, linewidth=2.0)
        # The solid is drawn over the sealant, which is seen in the cavity alone.
        draw_solid_across(axes, self.solid, *plane_at(self.outline, s_mm), zorder=3)
        axes.set_xlim(-shown_mm / 2, shown_mm / 2)
        axes.set_ylim(*self._ends_mm)
        axes.axis("off")
        _title(axes, f"Section at {s_mm:.0f} mm", "", layout)


def _title(axes: Axes, text: str, more: str, layout: FirstLayout) -> None:
    """Set a title. ``more`` is added if there is room for it."""
    axes.set_title(text + more if layout.whole_titles else text, fontsize=layout.font_pt, pad=4.0)


def _tens(length_mm: float) -> Floats:
    """Return round positions along the crack, (k,), except those that the label of the length would cover."""
    step = next(step for step in (5, 10, 20, 50, 100, 200, 500, 1000) if length_mm / step <= 10)
    return np.arange(0.0, length_mm - 0.4 * step, step)
