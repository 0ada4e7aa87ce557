"""A little interpreter of NC text, written from the controls' manuals and apart from the program.

It knows what a control knows: offset, tool in the spindle and its length, kinematics, modal words. It gives the machine's motions, as
positions of the axes. What it does not know it refuses: a word, or a motion from a position that cannot be known.
"""
import re


class Refused(Exception):
    pass


class Motion:
    __slots__ = ("rapid", "start", "end", "line", "tcp", "tool_mm", "spindle", "length_on", "safe_word", "tool", "moved", "state")

    def __init__(self, **values):
        for k, v in values.items():
            setattr(self, k, v)


WORD = re.compile(r"([A-Z])([+-]?(?:\d+\.?\d*|\.\d+))")


class Control:
    """One program on one machine. `lengths`: gauge length of each tool that the operator has set up, mm."""

    def __init__(self, machine, lengths, switchable=False, part_words=False, reads_on=True):
        self.m = machine
        self.lengths = lengths
        self.q = {n: None for n in machine.axes}
        self.tool = None
        self.next_tool = None
        self.length = None  # None: not known; 0: off; n: of tool n
        self.tcp = None if switchable else False
        self.switchable = switchable
        self.part_words = part_words  # the operator has set the offset for tool-centre-point control
        self.reads_on = reads_on  # behind the end there must be nothing; False: what is there is not run
        self.offset = None  # of the program: not known before it says so
        self.spindle = 0
        self.rapid = None
        self.ended = False
        self.motions = []
        self.line = 0
        self.feed, self.feed_mode, self.coolant, self.path_mode = None, None, frozenset(), None
        self.pauses = 0  # dwells and stops so far
        self.speed = None  # of the spindle; it holds until another is given
        self.cutter = 40  # G40, G41, G42: no path of ours is compensated by the control
        self.edge = None  # D, where that is a tool's cutting edge

    def run(self, text):
        for self.line, raw in enumerate(text.splitlines(), 1):
            line = self.strip(raw)
            if not line:
                continue
            if self.ended and not self.reads_on:
                return self.motions
            if self.ended and not self.after_end(line):
                raise Refused(f"line {self.line}: {raw!r} behind the end of the program")
            self.block(line, raw)
        if not self.ended:
            raise Refused("the program has no end")
        return self.motions

    def state(self):
        """What a cut depends on besides its place, as the words have set it."""
        return (self.offset, self.tool, self.length, self.edge, self.spindle, self.coolant, self.feed_mode, self.feed, self.path_mode == 64, self.pauses)

    def set_coolant(self, code):
        self.coolant = frozenset() if code == 9 else self.coolant | {code}

    def after_end(self, line):
        return line == "%"

    def tool_mm(self):
        if self.tool is None or self.tool not in self.lengths:
            raise Refused(f"line {self.line}: a motion with tool {self.tool}, whose length nobody knows")
        return self.lengths[self.tool]

    def change_tool(self):
        if self.next_tool is None:
            raise Refused(f"line {self.line}: a tool change without a tool")
        if not self.m.is_up(self.q["Z"]):
            raise Refused(f"line {self.line}: tool change with Z at {self.q['Z']}, the safe height is {self.m.safe}")
        self.tool = self.next_tool
        self.spindle = 0
        self.length = None

    def move(self, targets, rapid, machine_coordinates=False):
        """Words of one block, by axis, as numbers. Names that are not in it stay."""
        if self.cutter != 40:
            raise Refused(f"line {self.line}: a motion under G{self.cutter}")
        unknown = [n for n in targets if n not in self.m.axes]
        if unknown:
            raise Refused(f"line {self.line}: the machine has no axis {unknown}")
        start = dict(self.q)
        end = dict(self.q)
        tcp = self.tcp and not machine_coordinates
        if self.switchable and self.tcp is None and not machine_coordinates and any(n in self.m.linear for n in targets):
            raise Refused(f"line {self.line}: words of linear axes while the kinematics are not known")
        if machine_coordinates:
            end.update(targets)
        elif tcp:
            end.update({n: v for n, v in targets.items() if n in self.m.rotary})
            if any(end[n] is None for n in self.m.rotary) or self.length in (None, 0):
                raise Refused(f"line {self.line}: tool-centre-point control from an unknown position or without a length")
            tip = self.tip_words(start, targets)
            end = self.m.linear_for(tip, end, self.lengths[self.length])
        else:
            for n, v in targets.items():
                end[n] = v if n in self.m.rotary else self.joint_of_word(n, v)
        for n in targets:
            if start[n] is None and n != "Z" and not self.at_safe_height(start):
                raise Refused(f"line {self.line}: {n} moves from an unknown place and Z is not at the safe height")
        if start["Z"] is None and not machine_coordinates and not (list(targets) == ["Z"] and self.at_safe_height(end)):
            raise Refused(f"line {self.line}: a motion before Z is at a known place")
        for n, v in end.items():
            a = self.m.axes[n]
            low, high = (a.get("min_mm"), a.get("max_mm")) if n in self.m.linear else (a.get("min_deg"), a.get("max_deg"))
            if v is not None and low is not None and not low - 6e-4 <= v <= high + 6e-4:
                raise Refused(f"line {self.line}: {n} at {v}, beyond {low} to {high}")
        moved = [n for n in self.m.axes if end[n] is not None and (start[n] is None or abs(end[n] - start[n]) > 1e-9)]
        self.q = end
        only_up = machine_coordinates or (list(targets) == ["Z"] and self.at_safe_height(end))
        tool = self.lengths.get(self.tool, 0.0) if only_up else self.tool_mm()
        self.motions.append(Motion(rapid=rapid, start=start, end=dict(end), line=self.line, tcp=bool(tcp), tool_mm=tool, tool=self.tool,
                                   spindle=self.spindle, length_on=self.length, safe_word=machine_coordinates, moved=moved, state=self.state()))

    def at_safe_height(self, q):
        return self.m.is_up(q["Z"])

    def tip_words(self, start, targets):
        known = None
        if all(start[n] is not None for n in self.m.axes):
            known = self.m.tip_in_part(start, self.lengths[self.length])
        out = []
        for i, n in enumerate("XYZ"):
            if n in targets:
                out.append(targets[n])
            elif known is None:
                raise Refused(f"line {self.line}: {n} is not known under tool-centre-point control")
            else:
                out.append(known[i])
        return tuple(out)

    def joint_of_word(self, name, value):
        if self.offset is None:
            raise Refused(f"line {self.line}: no work offset was said")
        if self.length is None and abs(self.m.direction(name)[2]) > 1e-9:
            raise Refused(f"line {self.line}: {name} moves and the length compensation is not known")
        length = self.lengths[self.length] if self.length else 0.0
        sense = -1.0 if name in self.m.part_chain else 1.0
        along = [d * sense for d in self.m.direction(name)]
        point = (0.0, 0.0, -length)
        return value - sum(along[i] * (point[i] - self.m.offset[i]) for i in range(3))


class Iso(Control):
    """Fanuc-like words. `tcp_words`: the G code of tool-centre-point control."""

    TCP = {"fanuc_30i": 43.4, "haas_ngc": 234.0}

    def __init__(self, name, *args, **more):
        super().__init__(*args, **more)
        self.name = name
        self.decimal_point = name not in ("linuxcnc",)
        self.incremental = False

    def strip(self, raw):
        text = re.sub(r"\(.*?\)", "", raw)
        if self.name == "linuxcnc":
            text = text.split(";")[0]
        return text.strip().upper()

    def block(self, line, raw):
        if line == "%" or re.fullmatch(r"[O%]\d+", line):
            return
        if self.other(line):
            return
        words = WORD.findall(line)
        if "".join(a + b for a, b in words) != line.replace(" ", ""):
            raise Refused(f"line {self.line}: {raw!r} is not understood")
        self.words(words, raw)

    def other(self, line):
        return False

    def words(self, words, raw):
        g = [float(v) for a, v in words if a == "G"]
        m = [float(v) for a, v in words if a == "M"]
        value = {}
        for a, v in words:
            if a in "GMN":
                continue
            if a in "XYZABCR" and self.decimal_point and "." not in v:
                raise Refused(f"line {self.line}: {a}{v} without a point is increments")
            value[a] = float(v)
        axes = {n: value.pop(n) for n in list(value) if n in self.m.axes}
        machine = False
        tcp_on = self.TCP.get(self.name)
        for code in g:
            if code in (93, 94):
                self.feed_mode = code
            elif code in (61, 64):
                self.path_mode = code
            elif code in (40, 41, 42):
                self.cutter = code
                value.pop("D", None)
            elif code in (17, 21, 69, 80, 97, 90):
                continue
            elif code in (0, 1):
                self.rapid = code == 0
            elif code == 53:
                machine = True
            elif code == 43:
                if "H" not in value:
                    raise Refused(f"line {self.line}: G43 without H")
                self.length = int(value.pop("H"))
            elif tcp_on is not None and code == tcp_on:
                self.length = int(value.pop("H"))
                self.tcp = True
            elif code == 49:
                self.length = 0
                if tcp_on is not None:
                    self.tcp = False
            elif 54 <= code <= 59:
                self.offset = int(code) - 53
            elif code == 4:
                self.pauses += 1
                return
            else:
                raise Refused(f"line {self.line}: G{code:g} in {raw!r}")
        if "T" in value:
            self.next_tool = int(value.pop("T"))
        self.speed = value.pop("S", self.speed)
        feed = value.pop("F", None)
        if feed is not None and not feed > 0:
            raise Refused(f"line {self.line}: F {feed}")
        if feed is not None:
            self.feed = feed
        for n in ("H", "D", "P", "L"):
            if n in value and n != "P":
                raise Refused(f"line {self.line}: {n} in {raw!r}")
        for code in m:
            if code == 6:
                self.change_tool()
            elif code in (3, 4):
                self.spindle = (self.speed or 0) * (1 if code == 3 else -1)
                if not self.spindle:
                    raise Refused(f"line {self.line}: the spindle turns without a speed")
            elif code == 5:
                self.spindle = 0
            elif code in (7, 8, 9, 88, 89):
                self.set_coolant({89: 9}.get(code, code))
            elif code in (0, 1):
                self.pauses += 1
            elif code in (2, 30):
                self.ended = True
            elif code in (428, 429) and self.switchable:
                self.tcp = code == 428
            else:
                raise Refused(f"line {self.line}: M{code:g} in {raw!r}")
        if axes:
            if self.rapid is None:
                raise Refused(f"line {self.line}: a motion without a motion word")
            self.move(axes, self.rapid, machine)
            if machine and self.name in ("fanuc_30i", "iso", "haas_ngc", "hnc_8"):
                self.length = None if self.length else self.length  # G53 may drop it: to be said again


class LinuxCnc(Iso):
    pass


class Siemens(Iso):
    def strip(self, raw):
        return raw.split(";")[0].strip().upper()

    def other(self, line):
        bare = re.sub(r"^N\d+ *", "", line)
        if bare == "TRAORI":
            self.tcp = True
            self.length = self.tool if self.length in (None, 0) else self.length
            return True
        if bare == "TRAFOOF":
            self.tcp = False
            return True
        if bare == "CYCLE800()":  # no plane is swivelled in these programs: of an earlier one
            return True
        if bare in ("ORIAXES", "ORIMKS", "ORIWKS", "RTLION", "SOFT", "BRISK", "G500") or bare == "":
            return True
        return False

    def block(self, line, raw):
        line = re.sub(r"([ABC])=DC\(([-+.\d]+)\)", lambda f: f"{f[1]}{self.shorter(f[1], float(f[2])):.9f}", line)
        supa = "SUPA" in line
        line = line.replace("SUPA", "")
        line = line.replace("RTLION", "")
        if re.fullmatch(r"G641 ADIS=[\d.]+", line.strip()):
            self.path_mode = 64
            return
        if self.other(line.strip()):
            return
        words = WORD.findall(line)
        if "".join(a + b for a, b in words) != line.replace(" ", ""):
            raise Refused(f"line {self.line}: {raw!r} is not understood")
        rest = []
        for a, v in words:
            if a == "D":
                self.length = 0 if float(v) == 0 else self.tool
                self.edge = int(float(v))
            elif a == "G" and float(v) in (60, 64):
                self.path_mode = float(v)
            elif a == "G" and float(v) == 710:
                continue
            else:
                rest.append((a, v) if not (a == "G" and float(v) == 53) else (a, "53"))
        if supa:
            rest.append(("G", "53"))
        self.decimal_point = False
        self.words(rest, raw)

    def shorter(self, axis, angle):
        now = self.q[axis]
        if now is None:
            return angle
        return now + (angle - now + 180.0) % 360.0 - 180.0

    def after_end(self, line):
        return False


class Heidenhain(Control):
    def strip(self, raw):
        return re.sub(r"^\d+ *", "", raw.split(";")[0].strip())

    def after_end(self, line):
        return line.startswith("END PGM")

    def block(self, line, raw):
        if re.match(r"BEGIN PGM", line) or line.startswith("END PGM"):
            return
        if line == "M126":
            return
        found = re.fullmatch(r"TOOL CALL (\d+) Z(?: S(\d+))?", line)
        if found:
            self.next_tool = int(found[1])
            self.change_tool()
            self.length = self.tool
            return
        found = re.fullmatch(r"TOOL CALL Z S(\d+)", line)
        if found:
            self.speed = int(found[1])
            return
        if line in ("M3", "M4"):
            self.spindle = self.speed * (1 if line == "M3" else -1)
            return
        if line == "M5":
            self.spindle = 0
            return
        if line in ("M7", "M8", "M9"):
            self.set_coolant(int(line[1:]))
            return
        if line in ("M0", "M1"):
            self.pauses += 1
            return
        if line in ("M128", "M129"):
            self.tcp = line == "M128"
            return
        if line in ("M30", "M2"):
            self.ended = True
            return
        if re.match(r"CYCL DEF 247|Q339=", line):
            number = re.search(r"Q339=\+?(\d+)", line)
            if number:
                self.offset = int(number[1])
            return
        # No plane and no shift of this kind in these programs: of an earlier one.
        if line == "PLANE RESET STAY" or re.fullmatch(r"CYCL DEF 7\.(0 DATUM SHIFT|1 X\+0|2 Y\+0|3 Z\+0)", line):
            return
        if re.match(r"CYCL DEF 32\.|CYCL DEF 9\.", line):
            return
        if line == "L" or line.startswith("L "):
            body = line[2:]
            rapid = "FMAX" in body
            machine = "M91" in body
            body = body.replace("FMAX", "").replace("M91", "").replace("R0", "")
            feed = re.search(r"F([\d.]+)", body)
            if feed and not rapid:
                self.feed = float(feed[1])
            body = re.sub(r"F[\d.]+", "", body)
            words = re.findall(r"([XYZABC])([+-][\d.]+)", body)
            if "".join(a + b for a, b in words) != body.replace(" ", ""):
                raise Refused(f"line {self.line}: {raw!r} is not understood")
            targets = {}
            for a, v in words:
                targets[a] = float(v)
                if a in self.m.rotary and self.m.axes[a].get("cyclic") and self.q[a] is not None and a == "C":
                    now = self.q[a]
                    targets[a] = now + (float(v) - now + 180.0) % 360.0 - 180.0  # M126: the shorter way
            if not targets:
                return None
            return self.move(targets, rapid, machine)
        raise Refused(f"line {self.line}: {raw!r} is not understood")


def control_for(name, *args, **more):
    kinds = {"siemens_840d_sl": Siemens, "linuxcnc": LinuxCnc}
    if name == "heidenhain_tnc640":
        return Heidenhain(*args, **more)
    return kinds.get(name, Iso)(name, *args, **more)
