"""Constrained layout in a fraction of its time: an axis is measured by the texts of its ticks, which are not placed."""

from functools import partial
from typing import Any

from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.transforms import Bbox


class QuickLayout(ConstrainedLayoutEngine):
    """Places axes as constrained layout does, to about a point.

    Matplotlib updates, places and measures each tick several times for a layout, which takes longer than drawing.
    """

    def execute(self, fig: Any) -> None:
        axes = fig.get_axes()
        # A spine's extent is that of the axes and the ticks, which is measured with the labels.
        spines = [spine for one in axes for spine in one.spines.values() if spine.get_in_layout()]
        axises = [axis for one in axes for axis in (one.xaxis, one.yaxis)]
        for spine in spines:
            spine.set_in_layout(False)
        for axis in axises:
            vars(axis)["get_tightbbox"] = partial(_surroundings, axis)
        try:
            super().execute(fig)
        finally:
            for spine in spines:
                spine.set_in_layout(True)
            for axis in axises:
                del vars(axis)["get_tightbbox"]


def _surroundings(axis: Any, renderer: Any, *, for_layout_only: bool = True) -> Bbox | None:
    """Return the box of an axis's labels in pixels, as ``Axis.get_tightbbox`` does."""
    side, (tick,) = axis.get_label_position(), axis.get_major_ticks(1)
    near, far = (tick.label2, tick.label1) if side == "right" else (tick.label1, tick.label2)
    places = axis.get_majorticklocs()
    formatter = axis.get_major_formatter()
    labels = formatter.format_ticks(places) if near.get_visible() else []
    minor = axis.get_minor_formatter().format_ticks(axis.get_minorticklocs())
    # Labels at the top or on both sides, turned ones, labels between others, and a factor beside the axis.
    unusual = side == "top", far.get_visible(), near.get_rotation(), *minor
    if any((*unusual, formatter.get_offset())):
        return type(axis).get_tightbbox(axis, renderer, for_layout_only=for_layout_only)
    across = axis.axis_name == "x"
    (x0, y0), (x1, y1) = axis.axes.get_window_extent(renderer).get_points()
    begin, end = (x0, x1) if across else (y0, y1)
    first, last, *scaled = axis.get_transform().transform([*axis.get_view_interval(), *places])
    shown = [
        (begin + (end - begin) * (place - first) / (last - first), label)
        for place, label in zip(scaled, labels, strict=False)
        if min(first, last) <= place <= max(first, last)
    ]
    depth, low, high = renderer.points_to_pixels(tick.get_tick_padding()), begin, end
    if axis.label.get_text():
        extent = axis.label.get_window_extent(renderer)
        depth += renderer.points_to_pixels(axis.labelpad) + (extent.height if across else extent.width)
    if shown:
        shown.sort()
        # At 0, the place of a new tick, a logarithmic axis has no texts.
        tick.update_position(axis.get_view_interval()[0])
        sizes = [_size_px(near, label, renderer) for _, label in shown]
        along = 0 if across else 1
        depth += renderer.points_to_pixels(tick.get_pad()) + max(size[1 - along] for size in sizes)
        low, high = shown[0][0] - sizes[0][along] / 2, shown[-1][0] + sizes[-1][along] / 2
    if across:
        return Bbox([(low, y0 - depth), (high, y0)])
    return Bbox([(x0 - depth, low), (x0, high)] if side == "left" else [(x1, low), (x1 + depth, high)])


def _size_px(text: Any, label: str, renderer: Any) -> tuple[float, float]:
    """Return width and height of a label; ``text`` gets its own label when it is drawn."""
    text.set_text(label)
    return text.get_window_extent(renderer).size
