"""A real Slurm on this machine for tests: one controller, two nodes, only loopback.

Each node is a PID, mount and host name namespace of its own. So the two have different host names
and process ids as real machines do, and the death of a node is the death of its first process:
the kernel ends everything else in it, and nothing can be left behind.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

NODES = ("node1", "node2")
CORES_PER_NODE = 2
#: Programs that a cluster is made of.
NEEDED = ("slurmctld", "slurmd", "munged", "unshare", "setpriv")
_START_TIMEOUT_S = 30.0
_COMMAND_TIMEOUT_S = 60.0
#: Below the ports that the kernel gives to outgoing connections.
_PORTS = range(20_000, 32_000)

#: Every key can be changed by an argument of ``Cluster``.
_SETTINGS = {
    "ClusterName": "loopback",
    "SlurmUser": "root",
    "SlurmdUser": "root",
    "AuthType": "auth/munge",
    "CommunicationParameters": "NoInAddrAny,NoCtldInAddrAny",
    "ProctrackType": "proctrack/linuxproc",
    "TaskPlugin": "task/none",
    "JobAcctGatherType": "jobacct_gather/none",
    "AccountingStorageType": "accounting_storage/none",
    "MpiDefault": "none",
    "SelectType": "select/cons_tres",
    "SelectTypeParameters": "CR_Core",
    "SlurmdParameters": "config_overrides",
    "SchedulerParameters": "sched_interval=2,bf_interval=2,batch_sched_delay=1,"
    "requeue_delay=1,sched_min_interval=0",
    "SlurmdTimeout": "5",
    "MessageTimeout": "3",
    "TCPTimeout": "1",
    "KillWait": "5",
    "MaxArraySize": "100001",
    "MaxJobCount": "120000",
    "ReturnToService": "2",
    "PreemptType": "preempt/partition_prio",
    "PreemptMode": "REQUEUE",
    "MailProg": "/bin/true",
}

#: First process of a node. It takes in orphans, as the first process of any machine does.
_BOOT = """
set -e
mount --make-rprivate / && mount --bind "$1" /etc/hosts
hostname "$2"
slurmd -D -N "$2" & wait
"""


class ClusterError(Exception):
    """The cluster did not do what it was told."""


def why_not() -> str:
    """What keeps a cluster from being started here; empty when nothing does."""
    missing = [program for program in NEEDED if shutil.which(program) is None]
    if missing:
        return (
            f"not on the PATH: {', '.join(missing)}; install them with: apt-get install "
            "--no-install-recommends slurm-wlm munge"
        )
    if os.geteuid() != 0:
        return "a Slurm of one's own is started by root only"
    done = subprocess.run(
        [*_namespaces(), "true"], capture_output=True, text=True, check=False, timeout=30
    )
    return done.stderr.strip() and f"no namespaces of one's own here: {done.stderr.strip()}"


def _namespaces() -> list[str]:
    """The command that starts another in namespaces of its own; all of it ends with its parent."""
    kept = ["setpriv", "--pdeathsig", "KILL"]
    return [*kept, "unshare", "--pid", "--mount-proc", "--uts", "--fork", "--kill-child=KILL"]


def free_ports(count: int) -> list[int]:
    """Ports of loopback on which nothing listens."""
    found: list[int] = []
    for port in random.sample(_PORTS, len(_PORTS)):
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
        found.append(port)
        if len(found) == count:
            return found
    raise ClusterError("no free port")


def wait_until(
    condition: Callable[[], object], timeout_s: float, what: str, every_s: float = 0.05
) -> None:
    """Wait until something is so; fail when it does not come to be in time."""
    end = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > end:
            raise ClusterError(f"not within {timeout_s:g} s: {what}")
        time.sleep(every_s)


class Cluster:
    """Partitions ``debug`` (the default), ``low``, and ``high``, which preempts ``low``.

    Parameters
    ----------
    settings
        Lines of slurm.conf that differ from the usual ones, by key.
    """

    def __init__(self, settings: Mapping[str, str] | None = None) -> None:
        self._settings = _SETTINGS | dict(settings or {})
        self._daemons: dict[str, subprocess.Popen[bytes]] = {}
        self._folder: Path | None = None

    @property
    def folder(self) -> Path:
        """Where everything of the cluster is; also its logs."""
        assert self._folder is not None, "the cluster was not started"
        return self._folder

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self, timeout_s: float = _START_TIMEOUT_S) -> None:
        """Start every daemon; returns when both nodes are idle."""
        self._folder = Path(tempfile.mkdtemp(prefix="slurm-"))
        try:
            self._write()
            self._daemon("munged", *self._munge_command())
            wait_until((self.folder / "munge/sock").exists, timeout_s, "munged answers")
            self._daemon("slurmctld", *_namespaces(), "slurmctld", "-D", "-i")
            for name in NODES:
                self.start_node(name, wait=False)
            for name in NODES:
                self.wait_for_node(name, "IDLE", timeout_s)
        except BaseException as error:
            error.add_note(self._last_words())
            self.stop()
            raise

    def stop(self) -> None:
        """End everything at once and remove the folder."""
        for name in (*NODES, "slurmctld", "munged"):
            self._end(name)
        shutil.rmtree(self.folder)

    def start_node(self, name: str, *, wait: bool = True) -> None:
        """Switch a node on."""
        boot = ["sh", "-c", _BOOT, "boot", str(self.folder / "hosts"), name]
        self._daemon(name, *_namespaces(), *boot)
        if wait:
            self.wait_for_node(name, "IDLE")

    def kill_node(self, name: str) -> None:
        """A machine that dies: nothing in it gets to say a word. The controller is not told."""
        self._end(name)

    def kill_controller(self) -> None:
        """From here on every command of Slurm fails."""
        self._end("slurmctld")

    def wait_for_node(self, name: str, state: str, timeout_s: float = _START_TIMEOUT_S) -> None:
        """Wait for a state of a node, as scontrol calls it: IDLE, DOWN, ..."""
        wait_until(lambda: state in self.node_state(name), timeout_s, f"{name} {state}")

    def node_state(self, name: str) -> str:
        """What scontrol calls it, ``IDLE`` or ``DOWN*`` for instance; empty when it cannot tell."""
        done = self.run("scontrol", "-o", "show", "node", name, check=False)
        words = [word for word in done.stdout.split() if word.startswith("State=")]
        return words[0].removeprefix("State=") if words else ""

    def at_rest(self) -> bool:
        """Whether both nodes are idle and no job is in the queue."""
        jobs = self.run("squeue", "-h", "-a", check=False)
        idle = all(self.node_state(name) == "IDLE" for name in NODES)
        return idle and jobs.returncode == 0 and not jobs.stdout

    def environment(self) -> dict[str, str]:
        """The environment in which Slurm's programs find this cluster."""
        return {**os.environ, "SLURM_CONF": str(self.folder / "slurm.conf")}

    def run(self, *argv: str, check: bool = True) -> subprocess.CompletedProcess[str]:
        """Run a program in that environment, for a bounded time."""
        done = subprocess.run(
            argv,
            env=self.environment(),
            capture_output=True,
            text=True,
            check=False,
            timeout=_COMMAND_TIMEOUT_S,
        )
        if check and done.returncode:
            raise ClusterError(f"{' '.join(argv)}: {done.stderr.strip()}")
        return done

    def _daemon(self, name: str, *argv: str) -> None:
        with (self.folder / f"{name}.out").open("ab") as out:
            self._daemons[name] = subprocess.Popen(
                argv,
                env=self.environment(),
                cwd=self.folder,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
                start_new_session=True,
            )

    def _end(self, name: str) -> None:
        """Kill a daemon: the first process of its namespace, for which one outside waits."""
        daemon = self._daemons.pop(name, None)
        if daemon is None:
            return
        if daemon.poll() is None:
            children = Path(f"/proc/{daemon.pid}/task/{daemon.pid}/children").read_text()
            for process in map(int, children.split() or [daemon.pid]):
                os.kill(process, signal.SIGKILL)
        daemon.wait()

    def _last_words(self) -> str:
        """Ends of all logs."""
        logs = sorted([*self.folder.glob("*.log"), *self.folder.glob("*.out")])
        tails = (log.read_text(encoding="utf-8", errors="replace")[-1000:] for log in logs)
        return "\n".join(f"--- {log.name}\n{tail}" for log, tail in zip(logs, tails, strict=True))

    def _munge_command(self) -> list[str]:
        munge = self.folder / "munge"
        files = {"key-file": "key", "socket": "sock", "pid-file": "pid", "seed-file": "seed"}
        options = [f"--{option}={munge / file}" for option, file in files.items()]
        kept = ["setpriv", "--pdeathsig", "KILL"]
        return [*kept, "munged", "-F", *options, f"--log-file={munge}/log", "--num-threads=2"]

    def _write(self) -> None:
        """The munge key, the hosts file of the nodes, and slurm.conf."""
        self.folder.chmod(0o711)  # munged wants its socket within everyone's reach
        for name in ("munge", "ctld", *NODES):
            (self.folder / name).mkdir(mode=0o711)
        key = self.folder / "munge/key"
        key.touch(mode=0o600)
        key.write_bytes(os.urandom(1024))
        here = socket.gethostname().partition(".")[0]
        names = " ".join(("localhost", here, *NODES))
        (self.folder / "hosts").write_text(f"127.0.0.1 {names}\n", encoding="utf-8")
        (self.folder / "slurm.conf").write_text(self._configuration(here), encoding="utf-8")

    def _configuration(self, here: str) -> str:
        controller, *ports = free_ports(1 + len(NODES))
        settings = self._settings | {
            "SlurmctldHost": f"{here}(127.0.0.1)",
            "SlurmctldPort": str(controller),
            "AuthInfo": f"socket={self.folder}/munge/sock,cred_expire=5",
            "StateSaveLocation": f"{self.folder}/ctld",
            "SlurmdSpoolDir": f"{self.folder}/%n",
            "SlurmctldPidFile": f"{self.folder}/ctld/pid",
            "SlurmdPidFile": f"{self.folder}/%n/pid",
            "SlurmctldLogFile": f"{self.folder}/slurmctld.log",
            "SlurmdLogFile": f"{self.folder}/%n.log",
        }
        lines = [f"{key}={value}" for key, value in settings.items()]
        lines += [
            f"NodeName={name} NodeAddr=127.0.0.1 Port={port} CPUs={CORES_PER_NODE}"
            for name, port in zip(NODES, ports, strict=True)
        ]
        nodes = ",".join(NODES)
        lines += [
            f"PartitionName=debug Nodes={nodes} Default=YES State=UP",
            f"PartitionName=low Nodes={nodes} PriorityTier=1 PreemptMode=REQUEUE State=UP",
            f"PartitionName=high Nodes={nodes} PriorityTier=9 PreemptMode=OFF State=UP",
        ]
        return "\n".join(lines) + "\n"
