"""Time to write and to open the page of 2,000 runs (`wristctl runs report --all`), in Chromium without a window.

`python -m benchmarks.index_page` prints it; needs chromium and chromium-driver.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from tests.plotting.browser import CHROMIUM, DRIVER, Browser
from tests.plotting.many_runs import many_runs
from wristctl.plotting.index_page import index_page
from wristctl.records.find import entries

RUNS = 2000


def main() -> None:
    """Make the runs, write their page twice, open it thrice."""
    if not (CHROMIUM and DRIVER):
        sys.exit("needs chromium and chromium-driver")
    with tempfile.TemporaryDirectory() as folder:
        results, page = Path(folder) / "results", Path(folder) / "index.html"
        many_runs(results, RUNS)
        for what in ("the first time", "again"):
            began = time.monotonic()
            page.write_text(index_page(results, entries(results)))
            print(f"written {what}: {time.monotonic() - began:.1f} s, {page.stat().st_size / 1e6:.1f} MB")
        browser = Browser(Path(folder) / "profile")
        try:
            for _ in range(3):
                began, computed = time.monotonic(), browser.processor_time()
                browser.open(page, 1280, dark=False)
                shown = browser.run("return document.querySelectorAll('#runs > li').length")
                loaded = browser.run("return performance.getEntriesByType('navigation')[0].loadEventEnd")
                print(f"{shown} runs opened in {time.monotonic() - began:.2f} s, loaded after {loaded / 1e3:.2f} s")
                print(f"processor time of the browser: {browser.processor_time() - computed:.2f} s")
                typed = (
                    "const s = document.getElementById('search'); s.value = 'tune n199'; const b = performance.now();"
                )
                sought = browser.run(f"{typed} s.dispatchEvent(new Event('input')); return performance.now() - b")
                print(f"searched in {sought:.0f} ms")
        finally:
            browser.close()


if __name__ == "__main__":
    main()
