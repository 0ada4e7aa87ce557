#!/usr/bin/python3
"""A HAL component: a machine behind the control that warms up, faster than real ones. warm.json: how many seconds of the machine pass in one (`speedup`),
its seed, port and topic of an MQTT broker, what goes wrong when ([[from s, to s, "nan" | "clock"], ...], seconds since the start) and at which second the
broker (its process) is killed. Each 30 minutes of the machine it is measured, as a touch
would, in steps of 0.6 um with 0.4 um of noise. It publishes what a LinuxCNC of newer date publishes (mqtt-publisher: one JSON object of pins), ten times a second; truth.csv
has the joints and the true deviation of the tool (um) beside them.

The physics are those of tests/bench/thermal, whose runs teach the model; gains and drifts are another machine's day.
"""
import json
import math
import os
import random
import signal
import time

import hal
import paho.mqtt.client as mqtt

STEP_S, TOP_RPM = 5.0, 24000.0
TAUS, GAINS = (300, 900, 1800, 5400, 10800), (12, 10, 6, 4, 2)
MIX = ((0.9, 0.1, 0, 0, 0), (0.2, 0.7, 0.1, 0, 0), (0, 0.4, 0.6, 0, 0), (0, 0, 0.7, 0.3, 0), (0, 0, 0.1, 0.9, 0), (0, 0, 0, 0.4, 0.6), (0, 0, 0, 0, 1))


class Lag:
    def __init__(self, tau, value=0.0):
        self.share, self.value = 1 - math.exp(-STEP_S / tau), value

    def step(self, x):
        self.value += self.share * (x - self.value)
        return self.value


class Machine:
    def __init__(self, seed):
        r = self.random = random.Random(seed)
        self.time_s, self.air0 = 0.0, r.uniform(18, 26)
        self.heat_gain, self.air_slope, self.z_slope, self.wave_s = 1 + 0.05 * r.gauss(0, 1), 0.4 * r.gauss(0, 1), 0.6 * r.gauss(0, 1), r.uniform(2400, 9000)
        self.um_per_K = [c * (1 + 0.04 * r.gauss(0, 1)) for c in (-1.6, -0.8, 1.9, 4.5, 3.5)]
        self.warm, self.cold = [Lag(t) for t in TAUS], [Lag(t) for t in TAUS]
        self.felt, self.jump = [Lag(60.0) for _ in range(8)], Lag(20.0)
        self.deviation = {"x": 0.0, "y": 0.0, "z": 0.0}

    def step(self, rpm):
        self.time_s += STEP_S
        hours, speed = self.time_s / 3600, abs(rpm) / TOP_RPM
        air = self.air_slope * hours + 0.3 * math.sin(2 * math.pi * self.time_s / self.wave_s)
        nodes = [w.step(g * speed**1.4 * self.heat_gain) + c.step(air) for w, c, g in zip(self.warm, self.cold, GAINS)]
        self.deviation["z"] = sum(c * n for c, n in zip(self.um_per_K, nodes)) + self.jump.step(5 * speed**2) + self.z_slope * hours
        self.deviation["y"] = sum(c * n for c, n in zip((-0.5, -1.2, -3.0, -8.0, -4.0), nodes))
        for lag, row in zip(self.felt, MIX):
            lag.step(sum(m * n for m, n in zip(row, nodes)))
        self.felt[7].step(air)

    def touch(self):
        return {f"warm-machine.d{a}-um": round((self.deviation[a] + 0.4 * self.random.gauss(0, 1)) / 0.6) * 0.6 for a in "yz"}

    def temperatures(self):
        return [round((lag.value + self.air0 + 0.05 * self.random.gauss(0, 1)) / 0.1) * 0.1 for lag in self.felt]


def main():
    asked = json.load(open("warm.json"))
    machine = Machine(asked["seed"])
    h = hal.component("warm-machine")
    for a in "xyz":
        h.newpin(a, hal.HAL_FLOAT, hal.HAL_IN)
    h.newpin("rpm", hal.HAL_FLOAT, hal.HAL_IN)
    h.ready()
    client = mqtt.Client()
    client.connect_async("127.0.0.1", asked["mqtt_port"], 5)
    client.loop_start()
    out = open("truth.csv", "w", buffering=1)
    out.write("s,time_s,rpm,x,y,z,dy_um,dz_um,eoffset_y_um,eoffset_z_um,touched_y_um,touched_z_um\n")
    start, published, broker = time.monotonic(), 0.0, asked["broker_pid"]
    touched, touched_s = {}, -1e9
    try:
        while True:
            s = time.monotonic() - start
            offset_um = {a: 1000 * hal.get_value(f"axis.{a}.eoffset") for a in "yz"}  # at once: a process that waits would date it wrongly
            while machine.time_s + STEP_S <= s * asked["speedup"]:
                machine.step(h["rpm"])
            wrong = {what for begin, end, what in asked["wrong"] if begin <= s < end}
            out.write(f"{s:.3f},{machine.time_s:g},{h['rpm']:g},{h['x']:.6f},{h['y']:.6f},{h['z']:.6f},{machine.deviation['y']:.3f},{machine.deviation['z']:.3f},"
                      f"{offset_um['y']:.3f},{offset_um['z']:.3f},"
                      f"{touched.get('warm-machine.dy-um', 0):.2f},{touched.get('warm-machine.dz-um', 0):.2f}\n")
            if s - published >= 0.1:
                published = s
                values = {f"warm-machine.t{i + 1}": math.nan if "nan" in wrong else t for i, t in enumerate(machine.temperatures())}
                if machine.time_s - touched_s >= 1800:
                    touched, touched_s = machine.touch(), machine.time_s
                values |= touched | {"spindle.0.speed-out": h["rpm"], "warm-machine.time-s": machine.time_s - (3000 if "clock" in wrong else 0), "mqtt-publisher.period": 0}
                client.publish(asked["topic"], json.dumps(values))
            if broker and s > asked["broker_dies_s"]:
                os.kill(broker, signal.SIGKILL)
                broker = 0
            time.sleep(0.05)
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
