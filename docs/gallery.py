"""The gallery of the site: runs of one command each, with figure, answer, archive and report."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

PROGRAM = [sys.executable, "-m", "wristctl"]


# A loop with motors, elastic tendons and a camera.
RIG = "--set loop.control_period=0.005 --set loop.actuator.level=tendon --set loop.sensor.level=camera"


@dataclass(frozen=True)
class Exhibit:
    """One run of the gallery: name of its page, title, what to see in it, command, and stem of the figure shown."""

    name: str
    title: str
    about: str
    command: str
    figure: str


EXHIBITS = (
    Exhibit(
        "observer",
        "A disturbance observer follows",
        "Computed torque with a disturbance observer moves a wrist of four segments, which its one-segment model does "
        "not know. What the model lacks is measured and cancelled.",
        "simulate --controller ct-dob",
        "course",
    ),
    Exhibit(
        "two-planes",
        "The hand circles, with three tendons",
        "Circumduction in two planes: three tendons at 120 deg pull, and one controller runs for each plane.",
        "simulate --reference circumduction --controller ct-dob --set wrist.tendons=three",
        "bends",
    ),
    Exhibit(
        "space",
        "The dart-thrower's motion in space",
        "From radial extension to ulnar flexion and back, the way of most daily tasks. The report has the wrist in 3D, "
        "to be turned.",
        "simulate --reference dart-thrower --controller ct-dob",
        "space",
    ),
    Exhibit(
        "printed-gains",
        "The paper's gains as printed",
        "The paper's sliding mode controller with its gains as printed asks for so little torque that the wrist does "
        "not move.",
        "simulate --controller smc --gains printed",
        "course",
    ),
    Exhibit(
        "exchanged-gains",
        "The paper's gains, P1 and P2 exchanged",
        "With the two gains exchanged the wrist arrives late. Its tensions go from limit to limit hundreds of times a "
        "second.",
        "simulate --controller smc --gains exchanged",
        "tensions",
    ),
    Exhibit(
        "camera-and-tendons",
        "A camera, elastic tendons and friction",
        "The same motion as a rig has it: stepper motors, elastic tendons with friction in their sheaths, and a camera "
        "that is two frames late.",
        f"simulate --controller smc-dob --gains hardware {RIG} --set loop.actuator.sheath=1.0",
        "course",
    ),
    Exhibit(
        "control-period",
        "How slow may the controller be?",
        "Any number of a study can be swept. Here it is the control period, with motors, elastic tendons and a camera.",
        f"simulate --controller ct-dob --gains hardware {RIG} --sweep loop.control_period=0.002..0.016:29",
        "sweep-simulate.loop.control_period",
    ),
    Exhibit(
        "payload",
        "An unknown payload",
        "A hundred payloads are drawn at random. The controller knows of none.",
        f"simulate --controller pid-dob --gains hardware {RIG} --sweep loop.plant.payload=~0..0.3:100",
        "sweep-simulate.loop.plant.payload",
    ),
    Exhibit(
        "margins",
        "Margins of a loop",
        "Bode diagram of a geometric variable strain controller about the straight wrist, with its margins of gain, "
        "phase and delay.",
        "analyse --controller gvsc --gains default",
        "bode",
    ),
    Exhibit(
        "hysteresis",
        "Hysteresis of tendons",
        "Friction of the sheaths keeps the wrist from going back the way it came.",
        "analyse --of hysteresis",
        "loops",
    ),
    Exhibit(
        "which-controller",
        "Which controller?",
        "Three controllers with their hardware gains under six conditions, with intervals.",
        "compare quick --set 'controllers=[{controller: pid-ff, gains: hardware}, {controller: smc-dob, gains: "
        "hardware}, {controller: ct-dob, gains: hardware}]'",
        "answer",
    ),
    Exhibit(
        "tuning",
        "A search for gains",
        "A particle swarm looks for the gains of a PID controller with feedforward.",
        "tune --set controllers=[pid-ff] --set candidates=16 --set iterations=10",
        "convergence",
    ),
    Exhibit(
        "rehearsal",
        "The paper's experiment, emulated",
        "Motors, board, tendons and camera are emulated; the commands are those of the real rig.",
        "hw-run first-motion",
        "directions",
    ),
)


def write_gallery(docs: Path, work: Path, run: bool = True) -> None:
    """Run every exhibit into `work` and write gallery.md and a page of each into the folder `docs`."""
    pages = docs / "gallery"
    pages.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    shown = EXHIBITS if run else ()
    for exhibit in shown:
        sys.stderr.write(f"gallery: wristctl {exhibit.command}\n")
        (pages / f"{exhibit.name}.md").write_text(page(exhibit, pages, work))
    cards = "\n".join(
        f":::{{grid-item-card}} {exhibit.title}\n:link: gallery/{exhibit.name}\n:link-type: doc\n"
        f":img-top: gallery/{exhibit.name}.png\n:img-alt: {exhibit.title}\n:::\n"
        for exhibit in shown
    )
    names = "\n".join(f"gallery/{exhibit.name}" for exhibit in shown)
    (docs / "gallery.md").write_text(
        "# Gallery\n\nEach of these is one command and one sealed run, made when this site was built. Its page has the "
        "answer as the terminal shows it, the run's report, and the run itself.\n\n"
        + (
            f"::::{{grid}} 1 1 2 2\n:gutter: 3\n\n{cards}\n::::\n\n"
            if shown
            else "(This site was built without it.)\n\n"
        )
        + f"```{{toctree}}\n:hidden:\n\n{names}\n```\n"
    )


def page(exhibit: Exhibit, pages: Path, work: Path) -> str:
    """The page of an exhibit, after running it; its figure, report and archive are put into the folder `pages`."""
    answer = wristctl(shlex.split(exhibit.command), work).rstrip()
    folder = work / answer.splitlines()[-1]
    figure = folder / "figures" / f"{exhibit.figure}.png"
    if not figure.is_file():
        drawn = sorted(file.stem for file in figure.parent.glob("*.png"))
        raise FileNotFoundError(f"{exhibit.name}: no figure {exhibit.figure}, there are {', '.join(drawn)}")
    shutil.copy(figure, pages / f"{exhibit.name}.png")
    shutil.copy(folder / "report.html", pages / f"{exhibit.name}-report.html")
    wristctl(["runs", "pack", folder.name, "--file", str(pages / f"{exhibit.name}.zip")], work)
    return f"""\
# {exhibit.title}

{exhibit.about}

```console
$ wristctl {exhibit.command}
{answer}
```

![{exhibit.title}]({exhibit.name}.png)

The run {{download}}`as an archive <{exhibit.name}.zip>`, its {{download}}`report <{exhibit.name}-report.html>` (one
file, no network). To check and repeat it:

```console
$ wristctl runs unpack {exhibit.name}.zip
$ wristctl runs verify {folder.name}
$ wristctl runs replay {folder.name}
```
"""


def wristctl(words: list[str], work: Path) -> str:
    """What the command prints to stdout, run in the folder `work` with one thread. Raises where it fails."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    done = subprocess.run(
        [*PROGRAM, *words],
        cwd=work,
        env=os.environ | threads | {"COLUMNS": "100"},
        text=True,
        capture_output=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(f"wristctl {' '.join(words)} ended with {done.returncode}: {done.stderr[-2000:]}")
    return done.stdout
