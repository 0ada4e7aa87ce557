#!/usr/bin/env python3
"""class_sizes.py ROOT: the classes and functions of ROOT/include and ROOT/src, measured by ctags: what one class holds, over how many sources its
functions are spread, and what one function asks for. Breaches are "file:line: text", exit code 1; 77 where ctags is not installed.

ROOT/tests/arch/class-exceptions: one a line, "rule name most reason". An exception that is wider than what it is for, or for nothing, is a
breach itself: the list only shrinks.
"""
import collections
import json
import os
import re
import shutil
import subprocess
import sys

MOST = {"members": 15, "sources": 2, "parameters": 5}
HINT_LINES = 500
SAYS = {"members": "has {} data members (at most {}): what belongs together gets a type",
        "sources": "has its functions in {} sources (at most {})",
        "parameters": "takes {} parameters (at most {}): what belongs together gets a type"}


def parameters_of(signature):
    """Commas between the outer brackets, but those within <>, () and {}; a default value is none of its own."""
    inner = signature[1:signature.rindex(")")].strip()
    if inner in ("", "void"):
        return 0
    depth, count = 0, 1
    for letter in re.sub(r"->|<=|>=|<<", "", inner):
        depth += (letter in "<([{") - (letter in ">)]}")
        count += letter == "," and depth == 0
    return count


def full_name(*names):
    """Without what ctags calls unnamed namespaces."""
    return re.sub(r"__anon\w+::", "", "::".join(n for n in names if n)).removeprefix("trunnion::")


class Measured:
    """The largest figure of each name, and where it was found."""

    def __init__(self):
        self.figures = {}

    def note(self, rule, name, figure, path, line):
        if figure > self.figures.get((rule, name), (0,))[0]:
            self.figures[rule, name] = (figure, path, line)


def measure(root):
    command = ["ctags", "--languages=C++", "--kinds-C++=mcsfp", "--output-format=json", "--fields=+SnKZ", "--fields-C++=+{properties}", "-o", "-", "-R"]
    folders = [f for f in ("include", "src") if os.path.isdir(os.path.join(root, f))]
    done = subprocess.run(command + folders, cwd=root, capture_output=True, text=True, check=True)
    members, sources, first = collections.Counter(), collections.defaultdict(set), {}
    out = Measured()
    for tag in map(json.loads, done.stdout.splitlines()):
        kind, path, line = tag["kind"], tag["path"], tag["line"]
        scope = full_name(tag.get("scope", ""))
        if kind == "member" and "static" not in tag.get("properties", ""):
            # One name may stand for two classes in unnamed namespaces: they are of different files.
            members[scope, path] += 1
            first[scope, path] = min(line, first.get((scope, path), line))
        if kind == "function" and tag.get("scopeKind") in ("class", "struct") and path.endswith(".cpp"):
            sources[scope].add(path)
        if kind in ("function", "prototype") and tag.get("signature"):
            out.note("parameters", full_name(tag.get("scope", ""), tag["name"]), parameters_of(tag["signature"]), path, line)
    for (scope, path), count in members.items():
        out.note("members", scope, count, path, first[scope, path])
    for scope, files in sources.items():
        out.note("sources", scope, len(files), sorted(files)[0], 1)
    return out.figures


def exceptions_of(path):
    """(rule, name) to (most, line of the file)."""
    out, breaches = {}, []
    if not os.path.exists(path):
        return out, breaches
    for number, line in enumerate(open(path, encoding="utf-8"), 1):
        words = line.split(maxsplit=3)
        if not words or words[0].startswith("#"):
            continue
        if len(words) < 4 or words[0] not in MOST or not words[2].isdigit():
            breaches.append(f"tests/arch/class-exceptions:{number}: expected: members|sources|parameters name most reason")
            continue
        out[words[0], words[1]] = (int(words[2]), number)
    return out, breaches


def main():
    if not shutil.which("ctags"):
        print("skipped: ctags (universal-ctags) is not installed")
        sys.exit(77)
    root = sys.argv[1]
    figures = measure(root)
    exceptions, breaches = exceptions_of(os.path.join(root, "tests", "arch", "class-exceptions"))
    for (rule, name), (figure, path, line) in sorted(figures.items()):
        allowed, where = exceptions.get((rule, name), (MOST[rule], 0))
        if figure > allowed:
            breaches.append(f"{path}:{line}: {name} " + SAYS[rule].format(figure, allowed))
    for (rule, name), (allowed, where) in sorted(exceptions.items(), key=lambda e: e[1][1]):
        figure = figures.get((rule, name), (0,))[0]
        if figure < allowed:
            wanted = "not needed any more" if figure <= MOST[rule] else f"wider than needed: {figure} would do"
            breaches.append(f"tests/arch/class-exceptions:{where}: {rule} of {name}, {allowed}: {wanted}")
    for folder in ("include", "src"):
        for place, _, files in os.walk(os.path.join(root, folder)):
            for file in sorted(f for f in files if f.endswith((".hpp", ".cpp"))):
                path = os.path.join(place, file)
                lines = sum(1 for _ in open(path, encoding="utf-8"))
                if lines > HINT_LINES:
                    print(f"hint: {os.path.relpath(path, root)} has {lines} lines: is it still one concept?")
    if breaches:
        print(*breaches, "Limits, and what is excepted from them: tests/arch/class_sizes.py, tests/arch/class-exceptions.", sep="\n", file=sys.stderr)
        sys.exit(1)


if __name__ == "__main__":
    main()
