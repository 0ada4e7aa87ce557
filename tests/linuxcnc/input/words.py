#!/usr/bin/env python3
"""words.py PROGRAM FOLDER: short programs, each about one word or the state that it leaves, read by `PROGRAM post --from linuxcnc`, and with points behind the
numbers as programs for Fanuc, Haas and ISO controls. LinuxCNC's interpreter runs what was read and what was written: the tool must cut the same way, or
the program be refused. Exit code 77 where rs274 is not installed.
"""
import collections
import re
import shutil
import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
from campaign import judge  # noqa: E402

# Not here, since what differs is no fault of the reader: a feed of rotary axes from the pole (C at its beginning is free), G10 L2 (rs274 counts from the
# shift), M0 and a spindle that turns round in a cut (what is written comes down to the place again), and G73 behind G83 with its Z left out (taken as on Fanuc, refused by LinuxCNC).
HEAD = "G21 G90 G94 G17 G40 G49 G80\nG54\nT1 M6\nS1000 M3\nG43 H1\nG0 A0 C0\nG0 X0 Y0\nG0 Z60\nF200\n"
END = "G0 Z100\nM5\nM30\n"
WORDS = {
    "g90.1 arc": "G90.1\nG1 X10 Y0 Z40\nG3 X0 Y10 I0 J0\n",
    "g91.1 after g90.1": "G90.1\nG1 X10 Y0 Z40\nG3 X0 Y10 I0 J0\nG91.1\nG3 X-10 Y0 I0 J-10\n",
    "block delete": "G1 X1 Z40\n/G1 X50\nG1 Y5\n",
    "g92": "G1 X10 Y0 Z40\nG92 X0\nG1 X5\nG92.1\nG1 X7\n",
    "g92.2/3": "G1 X10 Y0 Z40\nG92 X0 Y5\nG1 X5 Y9\nG92.2\nG1 X7\nG92.3\nG1 X3 Y1\nG92.1\n",
    "g10 l20": "G1 X10 Y0 Z40\nG10 L20 P1 X0\nG1 X5\nG10 L2 P1 X0\n",
    "g52": "G1 X10 Y0 Z40\nG52 X5\nG1 X5\nG52 X0\nG1 X6\n",
    "g55": "G10 L2 P2 X5\nG55\nG1 X10 Z40\nG54\nG1 X10\n",
    "g54 as g59.3": "G59.3\nG1 X10 Z40\n",
    "g43.1": "G43.1 Z20\nG1 X10 Z60\nG43 H1\nG0 Z90\n",
    "g49": "G49\nG0 Z250\nG1 X10 Z230\nG43 H1\nG0 Z60\n",
    "g43.2": "G43.2 H2\nG1 X10 Z60\nG43 H1\nG0 Z60\n",
    "g4": "G1 X10 Z40\nG4 P1.5\nG1 X5\n",
    "g4 modal": "G1 X10 Z40\nG4 P1\nX5\n",
    "g0 then cycle modal": "G81 X5 Y5 Z30 R45\nG0 X9\nX12\nG80\n",
    "cycle then bare after g1": "G81 X5 Y5 Z30 R45\nG1 X9\nX12 Y3\n",
    "cycle no g80 z": "G81 X5 Y5 Z30 R45\nX7 Z25\nG80\n",
    "cycle r change": "G99 G81 X5 Y5 Z30 R45\nX7 R50\nX9\nG80\nG1 X0\n",
    "cycle g91": "G0 Z50\nG91 G81 X5 Y5 Z-10 R-5\nG90 G80\nG1 X0\n",
    "cycle g91 L": "G0 Z50\nG91 G81 X5 Y5 Z-10 R-5 L3\nG90 G80\nG1 X0\n",
    "cycle L2 g90": "G81 X5 Y5 Z30 R45 L2\nG80\nG1 X0\n",
    "cycle L0": "G81 X5 Y5 Z30 R45 L0\nG80\nG1 X0\n",
    "cycle g98 below": "G0 Z40\nG98 G81 X5 Y5 Z30 R45\nX9\nG80\nG1 X0\n",
    "cycle g99 below": "G0 Z40\nG99 G81 X5 Y5 Z30 R45\nX9\nG80\nG1 X0\n",
    "cycle twice": "G99 G81 X5 Y5 Z30 R45\nG98 G82 X9 Z31 R44 P1\nX3\nG80\nG1 X0\n",
    "g85 g86 g89": "G99 G85 X5 Y5 Z30 R45\nG86 X9 P1\nG89 X3 P1\nG80\nG1 X0\n",
    "cycle f": "G99 G81 X5 Y5 Z30 R45 F77\nX9 F99\nG80\nG1 X0\n",
    "cycle with A": "G81 X5 Y5 Z30 R45\nA10\nG80\nG1 X0\n",
    "g18 cycle": "G18\nG81 X5 Y5 Z30 R45\nG80\nG1 X0\n",
    "g43 in cycle": "G81 X5 Y5 Z30 R45\nG43 H1 X9\nG80\nG1 X0\n",
    "arc full": "G1 X10 Y0 Z40\nG2 I-10\n",
    "arc P3": "G1 X10 Y0 Z40\nG2 I-10 P3\n",
    "arc P2 end": "G1 X10 Y0 Z40\nG3 X0 Y10 I-10 P2\n",
    "helix P2": "G1 X10 Y0 Z40\nG3 X10 Y0 Z30 I-10 P2\n",
    "arc R neg": "G1 X10 Y0 Z40\nG3 X0 Y10 R-10\n",
    "arc radius off": "G1 X10 Y0 Z40\nG3 X0 Y10.2 I-10\n",
    "arc radius off a bit": "G1 X10 Y0 Z40\nG3 X0 Y10.0005 I-10\n",
    "arc with A": "G1 X10 Y0 Z40\nG3 X0 Y10 I-10 A5\n",
    "arc g18": "G18\nG1 X10 Y0 Z40\nG2 X0 Z50 I-10\n",
    "arc g19": "G19\nG1 X10 Y10 Z40\nG2 Y0 Z50 J-10\n",
    "arc g18 helix": "G18\nG1 X10 Y0 Z40\nG2 X0 Z50 I-10 Y5\n",
    "modal arc": "G1 X10 Y0 Z40\nG3 X0 Y10 I-10\nX-10 Y0 J-10\n",
    "g1 no f change g20": "G20\nG1 X1\nG21\nG1 X2\n",
    "g20 f": "G20\nF20\nG1 X1\nG21\nG1 X2\n",
    "g93": "G93 G1 X5 Z40 F2\nX9 F3\nG94 F100\nX1\n",
    "g93 no f": "G93 G1 X5 Z40 F2\nX9\nG94\n",
    "g95": "G95 F0.1\nG1 X5 Z40\nG94 F100\nX1\n",
    "rot only c": "G0 C400\nG1 X3 Z40 F200\nG0 C-30\nG1 X5\n",
    "g28": "G1 X3 Z40\nG28 Z90\nG0 X5 Y5\nG0 Z60\nG1 Z40\n",
    "g28 all": "G1 X3 Z40\nG28\nG0 X5 Y5\nG0 Z60\nG1 Z40\n",
    "g30": "G1 X3 Z40\nG30 Z90\nG0 X5 Y5\nG0 Z60\nG1 Z40\n",
    "g53 g1": "G1 X3 Z40\nG53 G1 X5\nG1 X7\n",
    "g53 modal": "G1 X3 Z40\nG53 G0 Z0\nG0 X5 Y5\nG0 Z60\nX7\nG1 Z40\n",
    "g5 spline": "G1 X0 Y0 Z40\nG5 I0 J3 P0 Q-3 X1 Y1\n",
    "g5.1": "G1 X0 Y0 Z40\nG5.1 X2 I1 J2\n",
    "g38": "G38.2 Z30\n",
    "g41": "G41 D1\nG1 X3 Z40\nG40\n",
    "g40 only": "G40 G1 X3 Z40\n",
    "g51 scale": "G51 P2\nG1 X3 Z40\n",
    "g68": "G68 R30\nG1 X3 Z40\n",
    "m98": "M98 P100\n",
    "o sub": "o100 sub\nG1 X#1 Y[#2*2]\no100 endsub\nG1 Z40\no100 call [3] [4]\n",
    "o sub return": "o100 sub\nG1 X#1\no100 return\nG1 X99\no100 endsub\nG1 Z40\no100 call [3]\n",
    "o repeat": "G1 Z40\n#1=0\no1 repeat [4]\n#1=[#1+1]\nG1 X#1\no1 endrepeat\n",
    "o do while": "G1 Z40\n#1=0\no1 do\n#1=[#1+1]\nG1 X#1\no1 while [#1 LT 3]\n",
    "o break": "G1 Z40\n#1=0\no1 while [1]\n#1=[#1+1]\nG1 X#1\no2 if [#1 GT 3]\no1 break\no2 endif\no1 endwhile\n",
    "o continue": "G1 Z40\n#1=0\no1 while [#1 LT 5]\n#1=[#1+1]\no2 if [#1 EQ 3]\no1 continue\no2 endif\nG1 X#1\no1 endwhile\n",
    "elseif": "G1 Z40\n#1=2\no1 if [#1 EQ 1]\nX1\no1 elseif [#1 EQ 2]\nX2\no1 else\nX3\no1 endif\n",
    "expr": "G1 Z40\nX[1+2*3**2/9-ABS[-1]] Y[ATAN[1]/[1]+SQRT[16]]\n",
    "expr prec": "G1 Z40\nX[2**3**2/100] Y[10 MOD 3 - 5]\n",
    "expr fix fup": "G1 Z40\nX[FIX[-1.5]] Y[FUP[-1.5]+ROUND[2.5]]\n",
    "expr bool": "G1 Z40\nX[[1 GT 0]+[2 EQ 2] AND 1] Y[1 XOR 1]\n",
    "param same line": "#1=5\nG1 Z40\n#1=7 X#1\nX#1\n",
    "two params": "#1=5 #2=#1\nG1 Z40 X#2\n",
    "exists": "#<a>=3\nG1 Z40 X[EXISTS[#<a>]] Y[EXISTS[#<b>]]\n",
    "global": "#<_g>=3\nG1 Z40 X#<_g>\n",
    "#5420": "G1 Z40 X5\nG1 X[#5420+1]\n",
    "#5220": "G1 Z40 X[#5220]\n",
    "##": "#1=2\n#2=9\nG1 Z40 X##1\n",
    "n numbers": "N10 G1 Z40\nN20 X5\nn15x6\n",
    "lower": "g1z40x5y-.5\n",
    "spaces": "G 1 Z 4 0 X - 5\n",
    "semicolon": "G1 Z40 X5 ; Y9\nY1 (Z2)\n",
    "2 g": "G0 G1 Z40\n",
    "m words": "G1 Z40 M8 X4 M3\nX1 M9\n",
    "m6 mid": "G1 Z40\nG0 Z90\nT2 M6\nG43\nG0 X5\nZ60\nG1 Z40\n",
    "m6 mid no g43": "G1 Z40\nG0 Z90\nT2 M6\nG0 X5\nZ60\nG1 Z40\n",
    "g43 no h": "G43\nG1 Z40 X5\n",
    "m30 mid": "G1 Z40\nX5\nG0 Z90\nM30\nG1 X9\n",
    "m2": "G1 Z40\nX5\nG0 Z90\nM2\n",
    "m73": "M73\nG91\n",
    "m70 72": "M70\nG91\nG1 X1\nM72\nG1 X5 Z40\n",
    "g64 p": "G64 P0.01\nG1 Z40 X5\nG61\nX1\n",
    "g7": "G7\nG1 Z40 X5\n",
    "g8": "G8\nG1 Z40 X5\n",
    "g33.1": "G33.1 Z30 K1\n",
    "g84": "G84 X5 Y5 Z30 R45\nG80\n",
    "g74": "G74 X5 Y5 Z30 R45\nG80\n",
    "g87": "G87 X5 Y5 Z30 R45 I1 J1 K1\nG80\n",
    "g17 cycle g98 a": "G0 A20 C30\nG98 G81 X5 Y5 Z30 R45\nX9\nG80\nG1 X0\n",
    "polar": "G1 Z40\n@5 ^30\n",
    "g0 diag all": "G0 X5 Y5 Z40 A10 C10\nG1 X0\n",
    "uvw": "G1 Z40 U5\n",
    "b": "G1 Z40 B5\n",
    "tool #": "T3 M6\nG43\nG0 Z60\nG1 X1\n",
    "g10 l1": "G10 L1 P1 Z25\nG43\nG1 Z40\n",
    "m66": "M66 P0 L0\nG1 Z40\n",
    "m62": "M62 P0\nG1 Z40\n",
    "s change": "G1 Z40\nS2000\nX5\nX1\n",
    "m4 above the part": "G1 Z40\nS2000\nX5\nG0 Z60\nM4\nG0 X1\nG1 Z40\n",
    "m19": "M19 R0\nG1 Z40\n",
    "percent mid": "G1 Z40\n%\nG1 X9\n",
}


LEAST_RIGHT = {"linuxcnc": 40, "fanuc_30i": 20, "haas_ngc": 20, "iso": 15}


def with_points(text):
    return re.sub(r"([XYZIJKRQFAC])(-?\d+)(?![\d.])", r"\1\2.", text)


def main():
    program, folder = str(Path(sys.argv[1]).resolve()), Path(sys.argv[2])
    if not shutil.which("rs274"):
        print("skipped: rs274 (linuxcnc-uspace) is not installed")
        sys.exit(77)
    folder.mkdir(parents=True, exist_ok=True)
    bad = 0
    for control, least in LEAST_RIGHT.items():
        counts = collections.Counter()
        own = control == "linuxcnc"
        for name, words in WORDS.items():
            text = HEAD + words + END
            came, why = judge(program, folder, text if own else with_points("G98\n" + text), control=control)
            counts[came] += 1
            if came in ("wrong", "crashed") or own and came.startswith("accepted"):
                bad += 1
                print(f"{control}, {name}: {came}: {why}")
        print(f"{control}: " + ", ".join(f"{came} {n}" for came, n in sorted(counts.items())))
        bad += counts["right"] < least
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
