"""The page of `pcmc explore` with the hall of the start page (needs Chromium and selenium)."""

import shutil
import time
from pathlib import Path

from selenium import webdriver

from pcmc import explore
from pcmc.explore.roof import read_roof

HALL = """
units = "m"
force = "kN"
[plan]
edge_length = 0.5
outline = [[0, 0], [16, 0], [16, 8], [0, 8]]
dividers = [[[9, 0], [9, 8]]]
[plan.patches]
hall = {rise = 2.0}
foyer = {rise = 1.7}
"""
Path("explored.toml").write_text(HALL, encoding="utf-8")
options = webdriver.ChromeOptions()
options.binary_location = str(shutil.which("chromium"))
for flag in ("--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"):
    options.add_argument(flag)
running = explore.start(read_roof("explored.toml"))
driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(str(shutil.which("chromedriver"))))
try:
    driver.set_window_size(1200, 860)
    driver.get(running.url)
    verdict = driver.find_element("css selector", "#verdict")
    while verdict.get_attribute("data-busy") != "false":
        time.sleep(0.1)
    time.sleep(1.0)
    driver.save_screenshot("page.png")
finally:
    driver.quit()
    running.close()
