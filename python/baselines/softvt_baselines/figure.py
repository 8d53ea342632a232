"""Pictures of the page of a study, in the look of the other pictures (docs/looks.md): text as text, on light and on dark ground."""

from collections.abc import Callable
from dataclasses import dataclass
from html import escape

import numpy as np

from . import results
from .results import Run

# Colours on light and on dark ground, as in src/media/palette.rs.
COLOURS = {
    "safe": ("#0072b2", "#56b4e9"),
    "over": ("#d55e00", "#ff8a3d"),
    "soft": ("#6b7280", "#9aa1ab"),
    "ink": ("#1c2024", "#e6e8eb"),
    "rule": ("#d5d9de", "#3a4047"),
    "ground": ("#ffffff", "#16181b"),
}
STYLE = (
    "text{fill:var(--ink)}.soft{fill:var(--soft)}.title{font-weight:600}.ground{fill:var(--ground)}.grid{stroke:var(--rule)}"
    ".limit{stroke:var(--over);stroke-width:1.4;stroke-dasharray:5 4}.ring{fill:var(--ground);stroke:var(--soft);stroke-width:2}"
    ".safe{fill:var(--safe)}.over{fill:var(--over)}.missed{fill:var(--soft)}path.missed{fill-opacity:.55}rect.safe,rect.over{fill-opacity:.22}"
    ".gap{stroke-width:3}.gap.safe{stroke:var(--safe)}.gap.over{stroke:var(--over)}"
)
# Sizes, px: a letter, and where the picture is narrow; the names at the left, a plot, the numbers next to it, and the gap to the next plot; a row
# of marks or of bars; the head of a plot, the gap below it, the ticks, and a line of the key.
FONT_SIZE, NARROW_FONT_SIZE, NARROW = 14, 18, 600
NAMES, PLOT, NUMBERS, GAP, EDGE = 170, 250, 70, 26, 12
MARKS, BARS, HEAD, FOOT, TICKS, KEY = 27, 40, 40, 14, 36, 28
# Bars of a distribution of D/τ: their edges, of which one is the limit. Values beyond the axis are at its ends.
FIRST, LAST, PER_DECADE = 0.1, 10**1.5, 12
EDGES = FIRST * 10 ** (np.arange(int(2.5 * PER_DECADE) + 1) / PER_DECADE)
EDGES[PER_DECADE] = 1  # exactly


@dataclass
class Plot:
    """The runs of a suite by the name of their row."""

    suite: str
    learned: dict[str, list[Run]]
    references: dict[str, list[Run]]

    @property
    def rows(self) -> dict[str, list[Run]]:
        return self.learned | self.references


def rates(plots: list[Plot]) -> str:
    """Goal and Safety of each row, and the gap between them."""
    ticks = {quarter / 100: f"{quarter} %" for quarter in (0, 25, 50, 75, 100)}
    key = [
        _circle(7, -5, 6.5, "ring") + _text(22, 0, "Goal Success") + _rect(176, -12, 32, 14, "over") + _circle(192, -5, 4.5, "over"),
        _circle(7, -5, 4.5, "safe") + _text(22, 0, "blue: no success is over the limit"),
    ]
    key[0] += _text(218, 0, "Safety Success, with its 95 % interval")
    key[1] += _circle(360, -5, 4.5, "over") + _text(375, 0, "orange: some are")
    title = "Goal and Safety Success of learned policies and of scripted controllers"
    return _picture(title, plots, MARKS, "Safety, %", ticks, key, _dumbbell)


def _dumbbell(left: float, middle: float, runs: list[Run]) -> str:
    """The marks of a row, in the colour that the pages of `softvt report` give them."""
    goal, safety = (results.rate(runs, measure) for measure in ("goal", "safety"))
    x = [left + 0.01 * PLOT * value for value in (goal.mean, safety.mean, safety.low, safety.high)]
    ring = _circle(x[0], middle, 6.5, "ring")
    if not any(np.isfinite(run.ratio).any() for run in runs):
        return ring + _number(left, middle, "–")
    verdict = "over" if any(_over(run).any() for run in runs) else "safe"
    band = _rect(x[2], middle - 8, x[3] - x[2], 16, verdict) if safety.high > safety.low else ""
    line = _line(x[1], middle, x[0], middle, f"gap {verdict}")
    return band + line + ring + _circle(x[1], middle, 4.5, verdict) + _number(left, middle, f"{safety.mean:.0f}")


def distributions(plots: list[Plot]) -> str:
    """The distribution of D/τ over the episodes of each row, on a logarithmic axis."""
    ticks = {_place(ratio): f"{ratio:g}" for ratio in (0.1, 0.3, 1, 3, 10, 30)}
    key = [
        _rect_of_key(0, "safe") + _text(22, 0, "safe") + _rect_of_key(100, "over") + _text(122, 0, "over the limit"),
        _text(0, 0, "Peak D/τ of the episodes; dashed: the limit; each row has its own scale"),
    ]
    key[0] += _rect_of_key(290, "missed") + _text(312, 0, "goal missed, dropped or slipped")
    title = "Distribution of the peak D/τ of each policy, by the result of the episode"
    return _picture(title, plots, BARS, "median", ticks, key, _bars, _place(1))


def _place(ratio: float) -> float:
    """Place of D/τ on its axis, of which the length is 1."""
    return float(np.log10(ratio / FIRST) / np.log10(LAST / FIRST))


def _bars(left: float, middle: float, runs: list[Run]) -> str:
    """The bars of a row: those of the results above each other, the highest as high as the row."""
    ratio = np.concatenate([run.ratio for run in runs])
    safe, over = (np.concatenate(of) for of in zip(*((run.safety == 1, _over(run)) for run in runs)))
    judged = np.isfinite(ratio)
    counts = [_counts(ratio[kind & judged]) for kind in (safe, over, ~(safe | over))]
    highest, base, below, drawn = max(1, np.sum(counts, axis=0).max()), middle + 0.5 * BARS - 4, np.zeros(len(EDGES) - 1), ""
    for name, count in zip(("safe", "over", "missed"), counts):
        drawn += _steps(left, base, below / highest, (below + count) / highest, name)
        below = below + count
    drawn += _line(left, base, left + PLOT, base, "grid")
    return drawn + _number(left, middle, f"{np.nanmedian(ratio):.2f}" if judged.any() else "–")


def _counts(ratios: np.ndarray) -> np.ndarray:
    """Episodes by bar; a bar includes its upper edge, as the limit includes itself."""
    bar = np.searchsorted(EDGES, ratios, side="left") - 1
    return np.bincount(bar.clip(0, len(EDGES) - 2), minlength=len(EDGES) - 1)


def _steps(left: float, base: float, low: np.ndarray, high: np.ndarray, name: str) -> str:
    """The bars between two heights, as one shape."""
    width, height, path = PLOT / len(low), BARS - 8, ""
    for bar in np.flatnonzero(high > low):
        x, bottom, top = left + bar * width, base - height * low[bar], base - height * high[bar]
        path += f"M{x:.1f} {bottom:.1f}V{top:.1f}h{width:.1f}V{bottom:.1f}z"
    return f'<path d="{path}" class="{name}"/>\n' if path else ""


def _over(run: Run) -> np.ndarray:
    """Episodes whose goal was reached over the limit."""
    return (run.goal == 1) & (run.safety == 0) & (run.ratio > 1) & np.isfinite(run.ratio)


def _picture(
    title: str,
    plots: list[Plot],
    row: int,
    heading: str,
    ticks: dict[float, str],
    key: list[str],
    drawn: Callable[[float, float, list[Run]], str],
    limit: float | None = None,
) -> str:
    """Two plots per line with the same rows, whose names are at the left, and a key below them.

    `row` is the height of a row, `heading` that of the numbers, `ticks` and `limit` are places on an axis of length 1, and `drawn` makes the
    marks of a row from the left end of its axis, the height of its middle, and its runs.
    """
    width, y, body = NAMES + 2 * (PLOT + NUMBERS) + GAP + EDGE, 0, ""
    for first in range(0, len(plots), 2):
        pair = plots[first : first + 2]
        learned = list(dict.fromkeys(name for plot in pair for name in plot.learned))
        names = learned + list(dict.fromkeys(name for plot in pair for name in plot.references))
        top, base = y + HEAD, y + HEAD + row * len(names)
        for number, name in enumerate(names):
            body += _text(NAMES - 16, top + row * (number + 0.5) + 5, name, "end", "" if name in learned else "soft")
        for column, plot in enumerate(pair):
            left = NAMES + column * (PLOT + NUMBERS + GAP)
            seeds = sorted({len(runs) for runs in plot.learned.values()})
            head = f'<tspan class="title">{escape(plot.suite.replace("_", " "))}</tspan>'
            head += f'<tspan class="soft" dx="8">{" or ".join(map(str, seeds))} seed{"s" * (seeds[-1] > 1)}</tspan>' if seeds else ""
            body += f'<text x="{left:.1f}" y="{y + 24:.1f}">{head}</text>\n' + _number(left, y + 19, heading, "soft")
            body += "".join(_line(left + PLOT * at, top, left + PLOT * at, base, "grid") for at in ticks)
            for number, name in enumerate(names):
                body += drawn(left, top + row * (number + 0.5), plot.rows[name]) if name in plot.rows else ""
            body += _line(left + PLOT * limit, top, left + PLOT * limit, base, "limit") if limit is not None else ""
            if first + 2 >= len(plots):
                body += "".join(_text(left + PLOT * at, base + 20, words, "middle", "soft") for at, words in ticks.items())
        y = base + FOOT
    y += TICKS
    notes = ["grey names: scripted controllers, which know the state"]
    if any(name.endswith("*") for plot in plots for name in plot.learned):
        notes.append("asterisk: from demonstrations of another teacher than the suite's")
    for line in [*key, *(_text(0, 0, note, "start", "soft") for note in notes)]:
        body += f'<g transform="translate({NAMES} {y})">\n{line}</g>\n'
        y += KEY
    return _image(width, y - KEY + 14, title, body)


def _image(width: float, height: float, title: str, body: str) -> str:
    light, dark = (";".join(f"--{name}:{colour[ground]}" for name, colour in COLOURS.items()) for ground in (0, 1))
    style = f"svg{{{light}}}@media(prefers-color-scheme:dark){{svg{{{dark}}}}}"
    # The width is that at which the picture is shown.
    style += f"{STYLE}@media(max-width:{NARROW}px){{text{{font-size:{NARROW_FONT_SIZE}px}}}}"
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" font-family="system-ui, sans-serif" '
    head += f'font-size="{FONT_SIZE}">\n<title>{escape(title)}</title>\n<style>{style}</style>\n'
    return f'{head}<rect class="ground" width="{width}" height="{height}"/>\n{body}</svg>\n'


def _text(x: float, y: float, words: str, anchor: str = "start", name: str = "") -> str:
    kind = f' class="{name}"' if name else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{kind}>{escape(words)}</text>\n'


def _number(left: float, middle: float, words: str, name: str = "") -> str:
    """A text next to a plot."""
    return _text(left + PLOT + NUMBERS - 4, middle + 5, words, "end", name)


def _line(x: float, y: float, to_x: float, to_y: float, name: str) -> str:
    return f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{to_x:.1f}" y2="{to_y:.1f}" class="{name}"/>\n'


def _circle(x: float, y: float, radius: float, name: str) -> str:
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" class="{name}"/>\n'


def _rect(x: float, y: float, width: float, height: float, name: str) -> str:
    return f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" class="{name}"/>\n'


def _rect_of_key(x: float, name: str) -> str:
    return f'<path d="M{x} 0v-12h14v12z" class="{name}"/>\n'
