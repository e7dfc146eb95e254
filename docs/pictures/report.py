"""The first two pages of a report, as pictures (needs pdftoppm)."""

import subprocess
from pathlib import Path

from PIL import Image

from pcmc.cli import main

HALL = """
units = "m"
force = "kN"
[plan]
edge_length = 1.0
outline = [[0, 0], [16, 0], [16, 8], [0, 8]]
dividers = [[[9, 0], [9, 8]]]
[plan.patches]
hall = {rise = 2.0}
foyer = {rise = 1.7}
"""
Path("hall.toml").write_text(HALL, encoding="utf-8")
main(["report", "hall.toml", "-o", "report.pdf", "--tolerance", "0.02"])
subprocess.run(["pdftoppm", "-png", "-l", "2", "-scale-to", "620", "report.pdf", "sheet"], check=True)
pages = [Image.open(path) for path in sorted(Path().glob("sheet-*.png"))]
both = Image.new("RGB", (sum(page.width for page in pages) + 20, pages[0].height), "#cccccc")
both.paste(pages[0], (0, 0))
both.paste(pages[1], (pages[0].width + 20, 0))
both.save("report.png")
