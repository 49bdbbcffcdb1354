"""Open a run in Rerun and keep what it shows as images/rerun.png: `python docs/rerun_picture.py`.

Needs `pip install rerun-sdk==0.41.0`, and a driver of Vulkan, of which Chromium's for the processor will do:
`VK_ICD_FILENAMES=/usr/lib/chromium/vk_swiftshader_icd.json LD_LIBRARY_PATH=/usr/lib/chromium`.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rerun
import rerun.blueprint as views
from rerun.experimental import ViewerClient
from shots import few_colours

PICTURE = Path(__file__).parent / "images" / "rerun.png"
MOTION = "simulate --reference circumduction --controller ct-dob --set wrist.tendons=three"
PORT = 9877
ADDRESS = f"rerun+http://127.0.0.1:{PORT}/proxy"
SETTLED = 15.0
"""Until the viewer has started, has read a file, or shows a layout without messages [s]."""


def wristctl(words: str, folder: str) -> str:
    """Last line of what a command prints."""
    command = [sys.executable, "-m", "wristctl", *words.split()]
    done = subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE, cwd=folder)
    return done.stdout.strip().splitlines()[-1]


def shown(file: Path, picture: Path) -> None:
    """Send an MCAP file to the viewer, bends above tensions, and take its picture."""
    rerun.init("wristctl")
    rerun.connect_grpc(ADDRESS)
    rerun.log_file_from_path(file)
    time.sleep(SETTLED)  # the file brings a layout of every stream, some of them empty
    bends = views.TimeSeriesView(origin="/bend/position", name="bend [rad]")
    tensions = views.TimeSeriesView(origin="/commands/effort", name="tension of each tendon [N]")
    layout = views.Blueprint(views.Vertical(bends, tensions), views.TimePanel(state="collapsed"), collapse_panels=True)
    rerun.send_blueprint(layout, make_active=True, make_default=True)
    time.sleep(SETTLED)
    ViewerClient(ADDRESS).save_screenshot(str(picture))
    rerun.disconnect()


def main() -> None:
    """Simulate, export, open, and keep the picture."""
    with tempfile.TemporaryDirectory() as folder:
        run, file = Path(wristctl(MOTION, folder)).name, Path(folder) / "circle.mcap"
        wristctl(f"runs export {run} --to mcap --file {file}", folder)
        words = ["--headless", "--bind", "127.0.0.1", "--port", str(PORT), "--window-size", "900x560"]
        viewer = subprocess.Popen(["rerun", *words], stdin=subprocess.DEVNULL, start_new_session=True)
        try:
            time.sleep(SETTLED)
            shown(file, Path(folder) / "shown.png")
            few_colours(Path(folder) / "shown.png", PICTURE)
        finally:
            os.killpg(viewer.pid, signal.SIGKILL)  # the program starts another one
            viewer.wait()


if __name__ == "__main__":
    main()
