#!/usr/bin/env python3
"""Draws example.svg, the picture of the README, from a report of bench.csv:

    servobee identify tests/data/bench.csv --out result
    python tests/data/make_example.py result/report.html > tests/data/example.svg
"""

import re
import sys

page = open(sys.argv[1], encoding="utf-8").read()


def figure(name):
    """Titles and plots of a figure."""
    begin = page.index(f'<figure id="{name}"')
    text = page[begin : page.index("</figure>", begin)]
    pair = r'<p class="title">(.*?)</p>(<svg.*?</svg>)'
    return re.findall(pair, text, flags=re.S)


# Width and height of a plot as it is shown, and of a title above it.
WIDTH, TITLE, GAP = 940, 26, 14
rows = [figure("time-spool")[1:3], figure("residual-spool")[0:1], figure("residual-spool")[1:2]]
parts, y = [], GAP
for row in rows:
    width = (WIDTH - GAP * (len(row) - 1)) / len(row)
    height = 0
    for i, (title, plot) in enumerate(row):
        _, _, w, h = map(float, re.search(r'viewBox="([^"]*)"', plot).group(1).split())
        x, high = GAP + i * (width + GAP), width * h / w
        parts.append(f'<text x="{x:.0f}" y="{y + 18}" font-size="15" font-weight="600">{title}</text>')
        place = f'<svg x="{x:.1f}" y="{y + TITLE}" width="{width:.1f}" height="{high:.1f}" '
        parts.append(place + plot[len("<svg ") :])
        height = max(height, high)
    y += TITLE + int(height) + GAP
style = (
    'svg[aria-label^="Where"] polyline[stroke="#D55E00"]{stroke-dasharray:24 12}'
    'polyline[stroke="#009E73"]{stroke-dasharray:8 12} polyline{stroke-linejoin:round}'
)
print(
    f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH + 2 * GAP} {y}" '
    f'font-family="DejaVu Sans, Arial, sans-serif" fill="#222222"><style>{style}</style>'
    f'<rect width="100%" height="100%" fill="#ffffff"/>{"".join(parts)}</svg>'
)
