"""A program on the headless control, for the tests beside this file."""
import json
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent


def result_of(name, command):
    """What `command`, run.py with its words, says of the program; it has come to its end without a message. Exit code 77 where LinuxCNC is not installed."""
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode == 77:
        print(done.stdout.strip())
        sys.exit(77)
    assert done.returncode == 0, f"{name}: {done.stdout} {done.stderr}"
    result = json.loads(done.stdout)
    assert result["ended"] and not result["messages"], f"{name}: {result}"
    return result


def ran(name, nc, machine, folder, seconds, *more):
    """The same of the program `nc` on the machine file `machine`, with the tools of folder/tools.json; the trace is then in folder/run/trace.txt."""
    return result_of(name, ["/usr/bin/python3", str(HERE / "run.py"), str(nc), str(machine), str(folder / "tools.json"), "--folder", str(folder / "run"),
                            "--seconds", str(seconds), *more])
