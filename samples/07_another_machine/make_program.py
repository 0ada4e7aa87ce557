#!/usr/bin/env python3
"""make_program.py PART.cls SIDES > impeller_tcp.nc: the first SIDES sides of the impeller of sample 01, as the post of a CAM system writes them
for LinuxCNC's xyzac-trt under tool-centre-point control (M428): tip and table angles, nothing of the machine's dimensions."""
import math
import sys

HEAD = """%
(IMPELLER, XYZAC-TRT, TOOL CENTRE POINT)
N10 G17 G21 G40 G49 G80 G90 G94
N20 G54 G64 P0.01
N30 T1 M6
N40 S18000 M3
N50 M8
N60 G43 H1
N70 M428
"""
TAIL = """M9
M5
M429
M30
%
"""


def table_angles(i, j, k, c_before):
    """Degrees: the tool axis along Z once the table has turned by C about Z, then by A about X; A at most 0, C next to where it was."""
    a = -math.degrees(math.atan2(math.hypot(i, j), k))
    c = math.degrees(math.atan2(-i, -j))
    return a, c + 360.0 * round((c_before - c) / 360.0)


def main():
    print(HEAD, end="")
    at = {}
    number, side, c, feed, rapid = 70, 0, 0.0, 0.0, False
    for line in open(sys.argv[1], encoding="utf-8"):
        word, _, rest = line.strip().partition("/")
        if word.startswith("$$ blade"):
            side += 1
            if side > int(sys.argv[2]):
                break
        elif word == "RAPID":
            rapid = True
        elif word == "FEDRAT":
            feed = float(rest.split(",")[0])
        elif word == "GOTO":
            x, y, z, i, j, k = map(float, rest.split(","))
            a, c = table_angles(i, j, k, c)
            to = {"X": x, "Y": y, "Z": z, "A": a, "C": c}
            words = [n + f"{v:.4f}" for n, v in to.items() if at.get(n) != f"{v:.4f}"]
            at.update({n: f"{v:.4f}" for n, v in to.items()})
            number += 10
            print(f"N{number} " + ("G0 " if rapid else "G1 ") + " ".join(words) + ("" if rapid else f" F{feed:.0f}"))
            rapid = False
    print(TAIL, end="")


main()
