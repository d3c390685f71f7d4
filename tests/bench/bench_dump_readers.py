"""Readers of particle dumps side by side: OVITO, pandas and this package.

Run as ``python tests/bench/bench_dump_readers.py``. The engine writes the same frames as text and
as binary; every reader then delivers every column of every frame, in turn, several times, and each
column is summed so that no reader gains by putting work off. The result is a table in Markdown.

OVITO is left out where it cannot be imported (``pip install ovito``).
"""

from __future__ import annotations

import io
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from liggghts_driver.results.binarydump import iter_binary_frames
from liggghts_driver.results.textdump import iter_text_frames

try:
    from ovito.io import import_file
except ImportError:
    import_file = None

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    # Reads everything and returns the sum of all numbers and the time it took.
    Reader = Callable[[], tuple[float, "Taken"]]

PARTICLES = 21_700
FRAMES = 20
STEPS_BETWEEN = 50
TURNS = 9
COLUMNS = ("id", "type", "x", "y", "z", "vx", "vy", "vz", "radius")

DECK = f"""
atom_style      granular
atom_modify     map array
boundary        p p p
newton          off
communicate     single vel yes
units           si
read_data       particles.data
neighbor        0.0005 bin
neigh_modify    delay 0
fix             m1 all property/global youngsModulus peratomtype 5.e6
fix             m2 all property/global poissonsRatio peratomtype 0.45
fix             m3 all property/global coefficientRestitution peratomtypepair 1 0.5
fix             m4 all property/global coefficientFriction peratomtypepair 1 0.5
pair_style      gran model hertz tangential history
pair_coeff      * *
timestep        1e-4
fix             move all nve/sphere
dump            text all custom {STEPS_BETWEEN} dump.txt {" ".join(COLUMNS)}
dump            single all custom {STEPS_BETWEEN} dump.bin {" ".join(COLUMNS)}
dump            series all custom {STEPS_BETWEEN} frame.*.bin {" ".join(COLUMNS)}
dump_modify     series pad 8
run             {STEPS_BETWEEN * (FRAMES - 1)}
"""


def write_particles(path: Path) -> None:
    """Spheres of 1.3 to 1.5 mm on a shaken lattice, at some millimetres per second."""
    rng = np.random.default_rng(20_250_101)
    pitch, side = 4e-3, 28
    places = np.argwhere(np.ones((side,) * 3, dtype=bool))[:PARTICLES]
    centres = (places + 0.5 + rng.uniform(-0.1, 0.1, places.shape)) * pitch
    diameters = rng.uniform(2.6e-3, 3.0e-3, PARTICLES)
    velocities = rng.normal(0.0, 3e-3, places.shape)
    box = "\n".join(f"0 {side * pitch} {axis}lo {axis}hi" for axis in "xyz")
    atoms = "\n".join(
        f"{k} 1 {d:.9g} 2500 {x:.9g} {y:.9g} {z:.9g}"
        for k, (d, (x, y, z)) in enumerate(zip(diameters, centres, strict=True), 1)
    )
    speeds = "\n".join(
        f"{k} {u:.9g} {v:.9g} {w:.9g} 0 0 0" for k, (u, v, w) in enumerate(velocities, 1)
    )
    path.write_text(
        f"Particles\n\n{PARTICLES} atoms\n1 atom types\n\n{box}\n\n"
        f"Atoms\n\n{atoms}\n\nVelocities\n\n{speeds}\n"
    )


def run_engine(folder: Path) -> None:
    write_particles(folder / "particles.data")
    (folder / "deck.in").write_text(DECK)
    command = ["stdbuf", "-oL", "liggghts", "-in", "deck.in"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{' '.join(command)} failed:\n{done.stdout[-2000:]}")


@dataclass(frozen=True)
class Taken:
    """Seconds of wall time, and of the processor, which other users of the machine change less."""

    wall_s: float
    cpu_s: float


def timed(read: Callable[[], Iterable[Iterable[np.ndarray]]]) -> Reader:
    """Turn something that gives the columns of each frame into a reader."""

    def reader() -> tuple[float, Taken]:
        wall, cpu = time.perf_counter(), time.process_time()
        total = sum(float(column.sum()) for columns in read() for column in columns)
        return total, Taken(time.perf_counter() - wall, time.process_time() - cpu)

    return reader


def columns_of(frames: Iterable[pd.DataFrame]) -> Iterable[Iterable[np.ndarray]]:
    return ([frame[name].to_numpy() for name in COLUMNS] for frame in frames)


def pandas_frames(path: Path) -> Iterable[pd.DataFrame]:
    for text in path.read_bytes().split(b"ITEM: TIMESTEP\n")[1:]:
        body = text.partition(b"ITEM: ATOMS")[2].partition(b"\n")[2]
        yield pd.read_csv(io.BytesIO(body), sep=r"\s+", header=None, names=COLUMNS)


def ovito_properties(pipeline: object) -> Iterable[Iterable[np.ndarray]]:
    names = ("Particle Identifier", "Particle Type", "Position", "Velocity", "Radius")
    for k in range(pipeline.source.num_frames):  # type: ignore[attr-defined]
        particles = pipeline.compute(k).particles  # type: ignore[attr-defined]
        yield [np.asarray(particles[name]) for name in names]


def ovito_from_the_second_pass(path: Path) -> Reader:
    """OVITO with a pipeline that has found the frames of the file already."""

    def reader() -> tuple[float, Taken]:
        pipeline = import_file(str(path))
        assert pipeline.source.num_frames == FRAMES
        return timed(lambda: ovito_properties(pipeline))()

    return reader


def readers(folder: Path) -> dict[str, Reader]:
    text, series = folder / "dump.txt", sorted(folder.glob("frame.*.bin"))
    ovito = {
        "OVITO, text": timed(lambda: ovito_properties(import_file(str(text)))),
        "OVITO, text, its scan for frames not counted": ovito_from_the_second_pass(text),
    }
    return (ovito if import_file else {}) | {
        "pandas.read_csv, text": timed(lambda: columns_of(pandas_frames(text))),
        "iter_text_frames": timed(lambda: columns_of(f.data for f in iter_text_frames(text))),
        "iter_binary_frames, one file": timed(
            lambda: columns_of(f.data for f in iter_binary_frames(folder / "dump.bin", COLUMNS))
        ),
        "iter_binary_frames, a file per frame": timed(
            lambda: columns_of(f.data for f in iter_binary_frames(series, COLUMNS))
        ),
    }


def interleave(tasks: dict[str, Reader]) -> dict[str, list[Taken]]:
    """Times of every task in every turn; a first turn is not counted."""
    times: dict[str, list[Taken]] = {name: [] for name in tasks}
    totals = {}
    for turn in range(TURNS + 1):
        for name, task in tasks.items():
            totals[name], taken = task()
            if turn:
                times[name].append(taken)
    # The text has six digits, and OVITO takes some columns in single precision.
    if np.ptp(list(totals.values())) > 1e-6 * max(totals.values()):
        sys.exit(f"the readers do not read the same numbers: {totals}")
    return times


def table(times: dict[str, list[Taken]], text_bytes: int) -> str:
    reference, *_ = times
    header = (
        "| reader | wall time, ms per frame | processor time, ms per frame | million particles/s "
        f"| MB/s of text | times as fast as {reference}, by wall time | by processor time |"
    )
    lines = [header, "|---|---|---|---|---|---|---|"]
    for name, taken in times.items():
        wall, cpu = [t.wall_s for t in taken], [t.cpu_s for t in taken]
        faster = [a.wall_s / b.wall_s for a, b in zip(times[reference], taken, strict=True)]
        leaner = [a.cpu_s / b.cpu_s for a, b in zip(times[reference], taken, strict=True)]
        rate = FRAMES / statistics.median(wall)
        lines.append(
            f"| {name} | {spread([1e3 * s / FRAMES for s in wall])} "
            f"| {spread([1e3 * s / FRAMES for s in cpu])} "
            f"| {PARTICLES * rate / 1e6:.2f} | {text_bytes / FRAMES * rate / 1e6:.0f} "
            f"| {spread(faster)} | {spread(leaner)} |"
        )
    return "\n".join(lines)


def spread(values: list[float]) -> str:
    return f"{statistics.median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def main() -> None:
    if shutil.which("liggghts") is None:
        sys.exit("This benchmark reads what the engine writes, and liggghts is not on the PATH.")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run_engine(folder)
        text_bytes = (folder / "dump.txt").stat().st_size
        times = interleave(readers(folder))
    if import_file is None:
        sys.stdout.write("OVITO cannot be imported and is left out (pip install ovito).\n")
    busy = os.getloadavg()[0]
    sys.stdout.write(
        f"{FRAMES} frames of {PARTICLES} particles, {len(COLUMNS)} columns, {text_bytes / 1e6:.1f} "
        f"MB of text. {TURNS} turns, interleaved: median (range); {os.cpu_count()} cores "
        f"with a load of {busy:.1f}. MB/s of text: for binary, of the text of the same frames."
        f"\n\n{table(times, text_bytes)}\n"
    )


if __name__ == "__main__":
    main()
