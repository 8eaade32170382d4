#!/usr/bin/env python3
"""examples/slurm under a real Slurm of one node, with daemons, key, sockets and folders of its own.

Prints SKIPPED with the reason and exits with 77 where the daemons are not installed or cannot start: shards themselves
are tested by bop_test.py. usage: slurm_test.py TRIBIN WORK_DIR
"""
import getpass
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import time

import small_dataset

ROOT = pathlib.Path(__file__).resolve().parents[2]
TRIBIN, WORK = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
SBIN = os.environ["PATH"] + ":/usr/sbin:/sbin"
SCENES, TASKS = 4, 2
daemons = []


def skip(reason):
    print(f"SKIPPED: {reason}")
    stop()
    sys.exit(77)


def stop():
    for process in reversed(daemons):
        process.terminate()
    for process in reversed(daemons):
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()


def started(name, command, environment):
    log = open(WORK / f"{name}.out", "w")
    daemons.append(subprocess.Popen(command, stdout=log, stderr=log, env=environment, start_new_session=True))
    time.sleep(0.3)
    if daemons[-1].poll() is not None:
        reason = (WORK / f"{name}.out").read_text().strip().splitlines()
        daemons.pop()
        skip(f"{name} does not start here: {reason[-1] if reason else 'it says nothing'}")


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def configuration():
    """slurm.conf: one node, processes followed without cgroups, nothing outside of the work folder."""
    for folder in ("state", "spool"):
        (WORK / folder).mkdir()
    return "\n".join([
        "ClusterName=tribin", f"SlurmctldHost={socket.gethostname()}(127.0.0.1)",
        f"SlurmUser={getpass.getuser()}", f"SlurmdUser={getpass.getuser()}",
        f"SlurmctldPort={free_port()}", f"SlurmdPort={free_port()}",
        "AuthType=auth/munge", "CredType=cred/munge", f"AuthInfo=socket={WORK}/munge.socket",
        "ProctrackType=proctrack/linuxproc", "TaskPlugin=task/none", "SwitchType=switch/none", "MpiDefault=none",
        "JobAcctGatherType=jobacct_gather/none", "AccountingStorageType=accounting_storage/none",
        "SelectType=select/cons_tres", "ReturnToService=2", "MailProg=/bin/true",
        f"StateSaveLocation={WORK}/state", f"SlurmdSpoolDir={WORK}/spool",
        f"SlurmctldPidFile={WORK}/slurmctld.pid", f"SlurmdPidFile={WORK}/slurmd.pid",
        f"NodeName=tribin-node NodeAddr=127.0.0.1 NodeHostname={socket.gethostname()} CPUs={max(2, os.cpu_count())} State=UNKNOWN",
        "PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP", ""])


def run(command, environment, seconds=60):
    return subprocess.run(list(map(str, command)), env=environment, capture_output=True, text=True, timeout=seconds)


def main():
    global WORK
    shutil.rmtree(WORK, ignore_errors=True)
    WORK.mkdir(parents=True)
    WORK = WORK.resolve()
    os.chmod(WORK, 0o755)
    for program in ("munged", "slurmctld", "slurmd", "sbatch", "scontrol"):
        if not shutil.which(program, path=SBIN):
            skip(f"{program} is not installed (apt-get install slurm-wlm munge)")
    data = small_dataset.simulated(TRIBIN, WORK / "data", SCENES)
    if data is None:
        skip("the simulated camera is not built in")

    environment = dict(os.environ, SLURM_CONF=str(WORK / "slurm.conf"), PATH=f"{TRIBIN.parent}:{SBIN}")
    (WORK / "munge.key").write_bytes(os.urandom(128))
    os.chmod(WORK / "munge.key", 0o400)
    (WORK / "slurm.conf").write_text(configuration())
    started("munged", ["munged", "--foreground", "--force", f"--key-file={WORK}/munge.key", f"--socket={WORK}/munge.socket",
                       f"--pid-file={WORK}/munged.pid", f"--log-file={WORK}/munged.log", f"--seed-file={WORK}/munged.seed"],
            environment)
    started("slurmctld", ["slurmctld", "-D", "-i", "-f", WORK / "slurm.conf"], environment)
    started("slurmd", ["slurmd", "-D", "-N", "tribin-node", "-f", WORK / "slurm.conf"], environment)
    deadline = time.time() + 20
    while "idle" not in run(["sinfo", "-h", "-o", "%T"], environment).stdout:
        if time.time() > deadline:
            skip("the node does not come up: " + run(["sinfo", "-h", "-o", "%T %E"], environment).stdout.strip())
        time.sleep(0.5)

    out = WORK / "out"
    submitted = run(["sbatch", "--wait", "--parsable", f"--array=0-{TASKS - 1}", "--cpus-per-task=1", f"--output={WORK}/task_%a.log",
                     ROOT / "examples/slurm/bop_array.sh", data, out, "--no-times"], environment, 240)
    logs = "".join(f.read_text() for f in sorted(WORK.glob("task_*.log")))
    assert submitted.returncode == 0, submitted.stderr + logs
    assert len(list(out.glob("shard_*.csv"))) == TASKS, logs
    merged = run([TRIBIN, "merge", *sorted(out.glob("shard_*.csv")), "-o", out / "results.csv"], environment)
    assert merged.returncode == 0, merged.stderr
    whole = run([TRIBIN, "bop", data, "--no-times", "-o", WORK / "whole.csv"], environment, 240)
    assert whole.returncode == 0, whole.stderr
    for extension in ("csv", "ndjson"):
        assert (out / f"results.{extension}").read_bytes() == (WORK / f"whole.{extension}").read_bytes(), extension
    print(f"an array of {TASKS} tasks under Slurm gives the bytes of one run")


if __name__ == "__main__":
    try:
        main()
    finally:
        stop()
