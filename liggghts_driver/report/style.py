"""How all figures look: colours that the colour-blind tell apart, and one way to make a PNG."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator, MaxNLocator, NullLocator

from liggghts_driver.report.numbers import number

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from matplotlib.axis import Axis

# The palette of Okabe and Ito (2008).
BLUE, VERMILION, GREEN = "#0072B2", "#D55E00", "#009E73"
ORANGE, SKY, PURPLE = "#E69F00", "#56B4E9", "#CC79A7"
INK, GREY, PALE, SHADE = "#1B1B1B", "#6B6B6B", "#C4C4C4", "#EEEEEE"
DASHED = (0, (5, 2))

_WIDTH_IN = 5.6
_PIXELS_PER_IN = 190
#: Ticks stand at these multiples of a power of ten.
_TICKS = (1, 2, 5, 10)
_MOST_TICKS = 7

_LOOK: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 10.5,
    "text.usetex": False,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.limits": (-3, 5),
    "axes.formatter.use_mathtext": True,
    "grid.color": "#E3E3E3",
    "grid.linewidth": 0.7,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "lines.linewidth": 1.8,
    "legend.frameon": False,
    "legend.fontsize": "medium",
    "legend.handlelength": 2.0,
    "legend.borderaxespad": 0.2,
}


def draw(paint: Callable[[Figure], None], height_in: float) -> bytes:
    """A PNG of what ``paint`` puts on a figure of the common width."""
    with mpl.rc_context(_LOOK):
        figure = Figure(figsize=(_WIDTH_IN, height_in), layout="constrained")
        FigureCanvasAgg(figure)
        paint(figure)
        for axes in figure.axes:
            for axis in (axes.xaxis, axes.yaxis):
                # Ticks at given places, or of a logarithm, stay as they are.
                if isinstance(locator := axis.get_major_locator(), MaxNLocator):
                    locator.set_params(steps=_TICKS)
        out = io.BytesIO()
        # Without the software's name, equal data give equal files.
        figure.savefig(out, format="png", dpi=_PIXELS_PER_IN, metadata={"Software": None})
    return out.getvalue()


def log_ticks(low: float, high: float) -> list[float]:
    """Powers of ten, with doubles and halves where they are few, thinned where they are many."""
    powers = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    ticks: list[float] = []
    for multiples in ((1, 2, 5), (1, 3), (1,)):
        ticks = [m * 10.0**n for n in powers for m in multiples if low <= m * 10.0**n <= high]
        if len(ticks) <= _MOST_TICKS:
            return ticks
    return ticks[:: -(-len(ticks) // _MOST_TICKS)]


def tick_at(axis: Axis, ticks: Sequence[float], words: Sequence[str]) -> None:
    """Ticks at these places with these words, and none between them."""
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_major_formatter(FixedFormatter(words))
    axis.set_minor_locator(NullLocator())


def tick_log(axis: Axis, low: float, high: float) -> None:
    """Ticks of a logarithmic axis that shows this range."""
    ticks = log_ticks(low, high)
    tick_at(axis, ticks, [number(tick, 1) for tick in ticks])
