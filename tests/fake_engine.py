"""A stand-in for the engine: reads a deck, writes what the real one writes, or fails as told.

The environment variable FAKE_ENGINE says how it behaves (see ``main``); what it computes is that
nothing moves. Only the standard library is used, so that it starts at once.
"""

from __future__ import annotations

import json
import os
import re
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

BANNER = "LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0-fake, compiled never, git commit none)"
ROW = "{:8d} {:8d} {:14.8g} "


class Output:
    """What goes to the screen and to the log alike."""

    def __init__(self, log: str) -> None:
        self.log = Path(log).open("wb")  # noqa: SIM115 - open as long as the process lives

    def line(self, text: str = "") -> None:
        self.write(f"{text}\n".encode())

    def write(self, data: bytes) -> None:
        for file in (sys.stdout.buffer, self.log):
            file.write(data)
            file.flush()


class Engine:
    """The state of a run."""

    #: In the place of a file to jump to.
    ENDED = "ended"

    def __init__(self, behaviour: str, out: Output) -> None:
        self.behaviour, self.out = behaviour, out
        self.step = 0
        self.pieces = self.done = 0
        self.total = 0  # last step of the pieces; 0 before them
        self.series: tuple[int, str, list[str]] | None = None
        self.piston_x = "0"
        self.frames: tuple[int, str, int] | None = None
        self.thermo = 1
        self.atoms: list[list[float]] = []
        self.types: list[int] = []

    def read_data(self, name: str) -> None:
        text = Path(name).read_text(encoding="utf-8")
        for line in text.split("Atoms\n\n")[1].split("\n\n")[0].splitlines():
            words = line.split()
            self.types.append(int(words[1]))
            self.atoms.append([float(words[0]), *map(float, words[4:7]), 0.0, 0.0, 0.0])

    def command(self, line: str) -> bool:
        """Carry out a command; False when it ends the engine."""
        words = line.split()
        if words[0] == "run":
            return self.run(int(words[1]))
        if words[0] == "print" and self.behaviour != "unfinished":
            text = line.split('"')[1].replace("$(step)", str(self.step))
            self.out.line(text.replace("$(v_piston_velocity)", "0"))
        if words[0] == "quit":
            return False
        self.settings(words, line)
        return True

    def follow(self, name: str) -> bool:
        """Echo the commands of a file and carry them out; False when one ends the engine."""
        following: str | None = name
        while following not in {None, self.ENDED}:
            following = self.through(following)
        return following != self.ENDED

    def through(self, name: str) -> str | None:
        """Go through a file; the one to jump to, None at its end, or that it ended the engine."""
        for line in Path(name).read_text(encoding="utf-8").splitlines():
            self.out.line(line)
            words = line.split()
            if not words or words[0].startswith("#"):
                continue
            if self.behaviour == "bad command" and words[0] == "pair_style":
                self.out.line("ERROR: Invalid pair style (../force.cpp:123)")
                return self.ENDED
            if words[0] == "jump" and self.done < self.pieces:
                return words[1]
            if not self.command(line):
                return self.ENDED
        return None

    def loop(self, words: list[str]) -> None:
        """The pieces: how many there are, and where they end."""
        if words[:2] == ["variable", "piece"]:
            self.pieces = int(words[3])
            steps = re.search(r"^run\s+(\d+)", Path("pieces.in").read_text("utf-8"), re.MULTILINE)
            self.total = self.step + self.pieces * int(steps.group(1))
        elif words[:2] == ["next", "piece"]:
            self.done += 1

    def restart(self, words: list[str]) -> None:
        """Write and read a state, and set the step."""
        if words[0] == "write_restart" and self.behaviour != "no restart":
            path = Path(words[1].replace("*", str(self.step)))
            path.parent.mkdir(exist_ok=True)
            path.write_text(json.dumps([self.step, self.atoms, self.types]), encoding="utf-8")
        elif words[0] == "read_restart":
            self.step, self.atoms, self.types = json.loads(Path(words[1]).read_text("utf-8"))
        elif words[0] == "reset_timestep":
            self.step = int(words[1])

    def settings(self, words: list[str], line: str) -> None:
        self.loop(words)
        self.restart(words)
        if words[0] == "read_data":
            self.read_data(words[1])
        elif words[:2] == ["fix", "series"]:
            _, title = re.findall(r'"([^"]*)"', line)
            name = re.search(r"file (\S+)", line).group(1)
            self.series = (int(words[4]), name, title.split())
            Path(name).write_text(title + "\n", encoding="utf-8")
        elif words[:2] == ["dump", "frames"]:
            self.frames = (int(words[4]), words[5], len(words[6:]))
        elif words[:2] == ["fix", "piston"]:
            self.piston_x = words[words.index("com") + 1]
        elif words[0] == "write_dump":
            self.write_frame(Path(words[3]), self.step, len(words[4:]))
        elif words[0] == "thermo":
            self.thermo = int(words[1])

    def run(self, steps: int) -> bool:
        self.out.line("Setting up run at Thu Jan  1 00:00:00 1970\n")
        self.out.line("Memory usage per processor = 1.0 Mbytes")
        self.out.line("    Step    Atoms            CPU ")
        if self.behaviour in {"slow", "wild"} and self.total:
            time.sleep(0.05)
        first = self.step + 1 if steps else self.step
        last = self.step + steps
        for step in range(first, last + 1):
            if not self.at(step, last, bool(steps)):
                return False
        self.out.line(
            f"Loop time of 0.25 on 1 procs for {steps} steps with "
            f"{len(self.atoms)} atoms, finish time Thu Jan  1 00:00:00 1970\n"
        )
        for part in ("Pair", "Neigh", "Comm", "Outpt", "Other"):
            self.out.line(f"{part:5} time (%) = 0.05 (20)")
        self.step = last
        return self.behaviour != "early" or last < self.total / 2 or not self.total

    def at(self, step: int, last: int, real: bool) -> bool:
        """Everything due at a step; False when the engine ends in it."""
        if step % self.thermo == 0 or step == last:
            atoms = len(self.atoms)
            if self.behaviour == "lost" and self.total and step > self.total / 2:
                atoms -= 1
            self.out.line(ROW.format(step, atoms, step * 1e-5))
        if self.series and real and step % self.series[0] == 0 and step:
            self.print_series(step)
        if self.frames and step % self.frames[0] == 0 and (real or step == 0):
            self.dump(step)
        return not (real and self.total and step >= self.total / 2) or self.halfway(step)

    def halfway(self, step: int) -> bool:
        behaviour = self.behaviour
        if behaviour == "error":
            self.out.line("ERROR on proc 0: Atom lost, 1 of 2 (../domain.cpp:123)")
            return False
        if behaviour == "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        if behaviour in {"hang", "stubborn"}:
            if behaviour == "stubborn":
                signal.signal(signal.SIGTERM, signal.SIG_IGN)
            child = subprocess.Popen(["sleep", "300"])
            Path("pids").write_text(f"{os.getpid()} {child.pid}", encoding="utf-8")
            self.out.line(ROW.format(step, len(self.atoms), 0.0))
            time.sleep(300)
        return True

    def print_series(self, step: int) -> None:
        assert self.series
        every, name, columns = self.series
        if self.behaviour == "short series" and step > self.total - every:
            return
        late = {"nan": "nan", "wild": "1e9"} if step > self.total / 2 else {}
        value = late.get(self.behaviour, "0")
        values = dict.fromkeys(columns, value) | {"step": str(step)}
        if "piston_x_m" in values:
            values["piston_x_m"] = self.piston_x
        with Path(name).open("a", encoding="utf-8") as file:
            file.write(" ".join(values.values()) + "\n")

    def dump(self, step: int) -> None:
        assert self.frames
        every, pattern, columns = self.frames
        path = Path(pattern.replace("*", f"{step:010d}"))
        is_last = self.total and step > self.total - every
        if self.behaviour == "no last frame" and is_last:
            return
        self.write_frame(path, step, columns)
        if self.behaviour == "cut frame" and is_last:
            path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
        if self.behaviour == "empty frame" and is_last:
            path.write_bytes(b"")

    def write_frame(self, path: Path, step: int, columns: int) -> None:
        movers = [a[:columns] for a, kind in zip(self.atoms, self.types, strict=True) if kind == 1]
        numbers = [number for atom in movers for number in atom]
        head = struct.pack("<qqi6i6dii", step, len(movers), 0, *[1] * 6, *[0.0] * 6, columns, 1)
        path.write_bytes(head + struct.pack(f"<i{len(numbers)}d", len(numbers), *numbers))


def install(folder: Path) -> Path:
    """Put the stand-in as a program into a folder; its path."""
    path = folder / "liggghts"
    text = Path(__file__).read_text(encoding="utf-8")
    path.write_text(f"#!{sys.executable} -SE\n{text}", encoding="utf-8")
    path.chmod(0o755)
    return path


def chatter(behaviour: str, out: Output) -> None:
    """What some engines print before anything else."""
    out.line(BANNER)
    if behaviour in {"flood", "one long line"}:
        end = b"\n" if behaviour == "flood" else b" "
        for _ in range(100):  # MB
            sys.stdout.buffer.write((b"WARNING: " + b"x" * 90 + end) * 10_000)
    if behaviour == "garbage":
        out.write(bytes(range(256)) * 64)


def main() -> int:
    """Behave as FAKE_ENGINE says; as the real engine when it says nothing."""
    arguments = dict(zip(sys.argv[1::2], sys.argv[2::2], strict=True))
    behaviour = os.environ.get("FAKE_ENGINE", "")
    if behaviour == "silent":
        return 1
    if arguments["-log"] == "none":  # asked for its version, or whether it knows some commands
        sys.stdout.write(BANNER + "\n")
        return 0
    out = Output(arguments["-log"])
    if behaviour == "empty log":
        return 1
    chatter(behaviour, out)
    whole = Engine(behaviour, out).follow(arguments["-in"])
    if behaviour == "return code 3":
        return 3
    return 1 if not whole and behaviour in {"error", "bad command"} else 0


if __name__ == "__main__":
    sys.exit(main())
