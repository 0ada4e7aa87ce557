#!/usr/bin/python3
"""A HAL component: the machine behind the control. truth.json: points and directions of A and C, the ball's centre with both at 0, the length of
the stylus, the distance of the centres at which they touch (mm); X, Y and Z carry the tool. The pin `hit` is true while they do.

Its chain is written apart from the program's.
"""
import json
import math
import time

import hal

truth = json.load(open("truth.json"))


def turned(v, n, degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    x = (n[1] * v[2] - n[2] * v[1], n[2] * v[0] - n[0] * v[2], n[0] * v[1] - n[1] * v[0])
    d = (n[0] * v[0] + n[1] * v[1] + n[2] * v[2]) * (1 - c)
    return [c * v[i] + s * x[i] + d * n[i] for i in range(3)]


def about(v, point, n, degrees):
    w = turned([v[i] - point[i] for i in range(3)], n, degrees)
    return [w[i] + point[i] for i in range(3)]


h = hal.component("truth")
for name in "xyzac":
    h.newpin(name, hal.HAL_FLOAT, hal.HAL_IN)
h.newpin("hit", hal.HAL_BIT, hal.HAL_OUT)
h.ready()
reach2 = truth["reach"] ** 2
at = None
try:
    while True:
        if at != (h["a"], h["c"]):
            at = (h["a"], h["c"])
            ball = about(about(truth["ball"], truth["c_point"], truth["c_direction"], at[1]), truth["a_point"], truth["a_direction"], at[0])
        d = (h["x"] - ball[0], h["y"] - ball[1], h["z"] - truth["length"] - ball[2])
        h["hit"] = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < reach2
        time.sleep(0.0002)
except KeyboardInterrupt:
    pass
