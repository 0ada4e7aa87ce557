"""Lets FreeCAD's own LinuxCNC post write the moves of an NC file, to compare times:

    NC=in.nc OUT=out.nc freecadcmd tests/bench/freecad_post.py

FreeCAD is given joint positions: it formats words, and neither reads a CL file nor turns anything into joints."""
import os
import re

import FreeCAD
import Path
from PathScripts.post import linuxcnc_post

MOVE = re.compile(r"(?:G[01] )?((?:[XYZAC]-?[\d.]+ ?)+)")

document = FreeCAD.newDocument("moves")
moves = document.addObject("Path::Feature", "Moves")
commands = []
place = {}
with open(os.environ["NC"], encoding="ascii") as nc:
    for line in nc:
        move = MOVE.match(line)
        if not move:
            continue
        place.update((word[0], float(word[1:])) for word in move.group(1).split())
        commands.append(Path.Command("G1", dict(place, F=10.0)))
moves.Path = Path.Path(commands)
linuxcnc_post.export([moves], os.environ["OUT"], "--no-show-editor")
