"""thermal_offsets.py [--port N] [--axes XYZ] [--hold-s S] [--slew-um-s V] [--clamp-um C] [--scale-um S]

HAL component for LinuxCNC 2.8 and later: asks `trunnion thermal serve` on the port of this computer for the correction and drives the control's external
offsets with it. In a HAL file, behind the motion module (README of the folder has the lines of the ini file):

    loadusr -Wn thermal-offsets python3 thermal_offsets.py --port 7979 --axes XYZ
    net thermal-x thermal-offsets.x-counts => axis.x.eoffset-counts
    net thermal-scale thermal-offsets.scale => axis.x.eoffset-scale
    net thermal-enable thermal-offsets.offsets-enable => axis.x.eoffset-enable

The correction is one of the machine's axes, so it is right for programs that command the axes (identity kinematics). Under tool-centre-point kinematics the control
adds an external offset before it turns into the part: `identity` is then to be false, and the offsets fade.

What happens:
  - an offset never changes faster than SLEW, whatever the service says and however long this process was not run
  - no answer, one that is no number or beyond CLAMP, sensors that are silent (`stale`), no reading that the service took: the offset is held for HOLD seconds
    from the last good reading on, and then fades to zero at SLEW
  - the machine off or not homed: the offset begins at zero, as LinuxCNC's does when it is switched on; the counts never jump
Time is a clock that never jumps.
"""
import argparse
import json
import math
import select
import socket
import sys
import time

PERIOD_S = 0.05
ASK_S = 1.0
ANSWER_S = 5.0  # a service that does not answer so long is asked on a new connection


class Service:
    """Asks for the correction without ever waiting."""

    def __init__(self, port):
        self.port, self.socket, self.text, self.asked_s, self.tried_s, self.waits = port, None, b"", -1e9, -1e9, False

    def close(self):
        if self.socket:
            self.socket.close()
        self.socket, self.text, self.waits = None, b"", False

    def step(self, now_s):
        """An answer as it came, or None."""
        try:
            if self.socket is None:
                if now_s - self.tried_s < ASK_S:
                    return None
                self.tried_s = now_s
                self.socket = socket.create_connection(("127.0.0.1", self.port), timeout=0.02)
                self.socket.setblocking(False)
            if self.waits and now_s - self.asked_s > ANSWER_S:
                self.close()
                return None
            if not self.waits and now_s - self.asked_s >= ASK_S:
                self.asked_s, self.waits = now_s, True
                self.socket.sendall(b'{"query": "live"}\n')
            if not select.select([self.socket], [], [], 0)[0]:
                return None
            piece = self.socket.recv(65536)
            if not piece:
                self.close()
                return None
            self.text += piece
            if b"\n" not in self.text:
                if len(self.text) > 1 << 20:
                    self.close()
                return None
            line, _, self.text = self.text.partition(b"\n")
            self.waits = False
            return line
        except OSError:
            self.close()
            return None


def correction_of(answer, axes, clamp_um):
    """um for each axis, and how old it is, s; None where the answer is not one to follow."""
    try:
        said = json.loads(answer)
        if said["ok"] is not True or said["stale"] is not False:
            return None
        out, age_s = {a: float(said["correction_um"]["d" + a]) for a in axes}, float(said["silent_s"])
    except (ValueError, KeyError, TypeError):
        return None
    good = age_s >= 0 and all(math.isfinite(v) and abs(v) <= clamp_um for v in out.values())
    return (out, age_s) if good else None


class Offsets:
    """One number for each axis that follows what is wanted within its limits, holds, and fades. um and seconds."""

    def __init__(self, axes, slew_um_s, hold_s):
        self.axes, self.slew_um_s, self.hold_s = axes, slew_um_s, hold_s
        self.at = {a: 0.0 for a in axes}
        self.wanted = {a: 0.0 for a in axes}
        self.heard_s, self.last_s = -math.inf, None

    def hear(self, correction, heard_s):
        self.wanted, self.heard_s = dict(correction), heard_s

    def fading(self, now_s):
        return now_s - self.heard_s > self.hold_s

    def begin(self, now_s):
        self.at, self.last_s = {a: 0.0 for a in self.axes}, now_s

    def step(self, now_s):
        # A process that was not run for long has not earned a larger step: the tool would feel it as a jump.
        dt = min(now_s - self.last_s, PERIOD_S) if self.last_s is not None else 0.0
        self.last_s = now_s
        for a in self.axes:
            step = self.slew_um_s * dt
            wanted = 0.0 if self.fading(now_s) else self.wanted[a]
            self.at[a] += min(max(wanted - self.at[a], -step), step)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--port", type=int, default=7979)
    parser.add_argument("--axes", default="XYZ")
    parser.add_argument("--hold-s", type=float, default=300.0)
    parser.add_argument("--slew-um-s", type=float, default=1.0)
    parser.add_argument("--clamp-um", type=float, default=200.0)
    parser.add_argument("--scale-um", type=float, default=0.01, help="of one count")
    options = parser.parse_args()
    axes = options.axes.lower()
    if not axes or set(axes) - set("xyz") or min(options.hold_s, options.slew_um_s, options.clamp_um, options.scale_um) <= 0:
        sys.exit("thermal_offsets: axes are some of XYZ, the numbers are above 0")
    import hal

    h = hal.component("thermal-offsets")
    for a in axes:
        h.newpin(f"{a}-counts", hal.HAL_S32, hal.HAL_OUT)
        h.newpin(f"{a}-um", hal.HAL_FLOAT, hal.HAL_OUT)
    for name, kind, way in (("scale", hal.HAL_FLOAT, hal.HAL_OUT), ("offsets-enable", hal.HAL_BIT, hal.HAL_OUT), ("fading", hal.HAL_BIT, hal.HAL_OUT),
                            ("identity", hal.HAL_BIT, hal.HAL_IN), ("enable", hal.HAL_BIT, hal.HAL_IN)):
        h.newpin(name, kind, way)
    h["scale"] = options.scale_um / 1000.0
    h["identity"] = h["enable"] = True
    h.ready()
    service, offsets = Service(options.port), Offsets(axes, options.slew_um_s, options.hold_s)
    counts, base, since_s = {a: 0 for a in axes}, {a: 0 for a in axes}, {}
    try:
        while True:
            now_s = time.monotonic()
            answer = service.step(now_s)
            heard = correction_of(answer, axes, options.clamp_um) if answer is not None else None
            if heard:
                offsets.hear(heard[0], now_s - heard[1])
            if not (h["enable"] and h["identity"]):
                offsets.hear({a: 0.0 for a in axes}, now_s)
            on = bool(hal.get_value("motion.motion-enabled")) and bool(hal.get_value("motion.is-all-homed"))
            if on:
                offsets.step(now_s)
            else:
                offsets.begin(now_s)
            for a in axes:
                # Switched on again, the control has begun at zero: where it is is where this goes on, and the counts do not move.
                held_um = 1000.0 * hal.get_value(f"axis.{a}.eoffset-request") if on else 0.0
                lost = abs(held_um - (counts[a] - base[a]) * options.scale_um) > 2 * options.scale_um
                since_s[a] = since_s.get(a, now_s) if lost else now_s
                if not on or now_s - since_s[a] > 10 * PERIOD_S:
                    base[a] = counts[a] - round(held_um / options.scale_um)
                    offsets.at[a] = held_um
                    since_s[a] = now_s
                counts[a] = base[a] + round(offsets.at[a] / options.scale_um)
                h[f"{a}-counts"] = counts[a]
                h[f"{a}-um"] = offsets.at[a]
            h["offsets-enable"] = on
            h["fading"] = offsets.fading(now_s)
            time.sleep(PERIOD_S)
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
