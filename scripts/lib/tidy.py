"""Runs clang-tidy over all files that a build knows, many at a time; see scripts/tidy.sh.

Nearly all of the time goes into the headers of Eigen, OpenCV, Ceres and the standard library and into their templates. So the
files of several folders are checked as one, as far as no two of them give the same name to different things.
"""

import functools
import json
import pathlib
import re
import shlex
import subprocess
import sys

LINES = 8000  # in one piece: more take many gigabytes
NAME = re.compile(r"(\w+)\s*[({=;\[]")
TYPE = re.compile(r"(?:template <.*> )?(?:struct|class|enum class|enum) (\w+)\b(?!::|<)")
DEFINED_TYPE = re.compile(r"(?:struct|class|enum class|enum) (\w+)(?: final)?(?: :.*)? \{")
CONSTANT = re.compile(r"inline constexpr [\w:<>]+ (k\w+)")
TEST = re.compile(r"TEST(?:_F|_P)?\((\w+), *(\w+)")
DEFINE = re.compile(r"#define (\w+)")
INCLUDE = re.compile(r'#include "(.*)"')
NOT_A_NAME = (" ", "#", "//", "namespace ", "}", ")", "TEST")
REPORT = re.compile(r"^(?=/\S+:\d+:\d+: (?:warning|error):)", re.MULTILINE)
ERROR = re.compile(r"^(/\S+):\d+:\d+: error:.*\[clang-diagnostic-error\]", re.MULTILINE)


@functools.cache
def text_of(path):
    return path.read_text(encoding="utf-8")


@functools.cache
def names_in(path):
    """What a file defines outside of all functions: the first column tells, as clang-format leaves it."""
    names = set()
    for line in text_of(path).splitlines():
        if test := TEST.match(line):
            names.add(test[1] + "_" + test[2])
        elif define := DEFINE.match(line):
            names.add(define[1])
        elif line and not line.startswith(NOT_A_NAME):
            name = TYPE.match(line) or NAME.search(line)
            if name and not line[: name.start()].endswith(("::", "~")):
                names.add(name[1])
    return names - {"main"}


@functools.cache
def names_of_header(path):
    """Types and constants: functions it declares are its own source's."""
    return {name[1] for line in text_of(path).splitlines() if (name := DEFINED_TYPE.match(line) or CONSTANT.match(line))}


class Headers:
    """Which headers of the project a file reads."""

    def __init__(self, folders):
        self.folders = folders
        self.known = {}

    def of(self, path):
        if path not in self.known:
            self.known[path] = set()  # a circle ends here
            for name in INCLUDE.findall(text_of(path)):
                found = next((f / name for f in (path.parent, *self.folders) if (f / name).exists()), None)
                if found:
                    found = found.resolve()
                    self.known[path] |= {found} | self.of(found)
        return self.known[path]


class Piece:
    """Files without a name in common, neither with each other nor with the headers of another."""

    def __init__(self):
        self.files, self.headers = [], set()
        self.own, self.read = set(), set()
        self.lines = 0

    def takes(self, path, headers):
        names = names_in(path)
        if self.lines + text_of(path).count("\n") > LINES or names & (self.own | self.read):
            return False
        return not any(names_of_header(header) & (self.own | names) for header in headers - self.headers)

    def add(self, path, headers):
        self.files.append(path)
        self.lines += text_of(path).count("\n")
        self.own |= names_in(path)
        for header in headers - self.headers:
            self.read |= names_of_header(header)
        self.headers |= headers


def pieces_of(sources, headers):
    pieces = []
    for path in sources:
        read = headers.of(path)
        piece = next((p for p in pieces if p.takes(path, read)), None)
        if piece is None:
            piece = Piece()
            pieces.append(piece)
        piece.add(path, read)
    return [piece.files for piece in pieces]


def flags_of(commands):
    """All folders of headers and all definitions of the build."""
    flags = {}
    for command in commands:
        words = shlex.split(command["command"])
        for word, after in zip(words, words[1:]):
            if word.startswith(("-I", "-D")):
                flags[word] = None
            elif word == "-isystem":
                flags["-isystem" + after] = None
    return ["-std=c++20", *flags]


def is_fresh(log, files):
    """Neither a file nor a header has changed since."""
    depends = log.with_suffix(".d")
    if not log.exists() or not depends.exists():
        return False
    listed = text_of(depends).replace("\\\n", " ").split()[1:]
    paths = [pathlib.Path(name) for name in listed]
    return set(map(str, files)) <= set(listed) and all(p.exists() and p.stat().st_mtime <= log.stat().st_mtime for p in paths)


class Tidy:
    def __init__(self, top, build):
        self.top, self.out = top, build / "tidy"
        self.out.mkdir(exist_ok=True)
        commands = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
        self.flags = flags_of(commands)
        found = {pathlib.Path(command["file"]) for command in commands} | set(top.glob("examples/*/*.cc"))
        own = [p for p in found if top in p.parents and "build" not in p.relative_to(top).parts]
        self.sources = sorted(own, key=lambda path: (path.stem.endswith("_test"), path))
        self.headers = Headers([pathlib.Path(flag[2:]) for flag in self.flags if flag.startswith("-I")])

    def run(self, only):
        wanted = [s for s in self.sources if not only or any(o in str(s.relative_to(self.top)) for o in only)]
        pieces, texts = pieces_of(wanted, self.headers), []
        while pieces:
            files = pieces.pop(0)
            text = self.look_at(files, len(pieces))
            wrong = set(ERROR.findall(text))
            odd = [path for path in files if str(path) in wrong]
            if not wrong or len(files) == 1:
                texts.append(text)
            elif odd and len(odd) < len(files):  # names clash after all, there alone
                texts.append("".join(report for report in REPORT.split(text) if not ERROR.match(report)))
                pieces.append(odd)
            else:
                middle = len(files) // 2
                pieces += [files[:middle], files[middle:]]
        return texts

    def look_at(self, files, left):
        name = "_".join(files[0].relative_to(self.top).with_suffix("").parts) + f"_{len(files)}"
        log = self.out / f"{name}.log"
        if not is_fresh(log, [*files, self.top / ".clang-tidy"]):
            print(f"tidy.sh: {len(files)} files from {files[0].relative_to(self.top)} on, {left} pieces after this", file=sys.stderr, flush=True)
            self.check(files, self.out / f"{name}.cxx", log)
        return log.read_text(encoding="utf-8")

    def check(self, files, source, log):
        text = "".join(f'#define main main_{number}\n#include "{path}"\n#undef main\n' for number, path in enumerate(files))
        source.write_text(text, encoding="utf-8")
        depends = log.with_suffix(".d")
        subprocess.run(["clang++", *self.flags, "-MM", "-MF", depends, source], cwd=self.top, check=True)
        with depends.open("a", encoding="utf-8") as text:
            text.write(f" {self.top / '.clang-tidy'}\n")
        # The piece itself is no file of the project, and including sources is its purpose.
        done = subprocess.run(["clang-tidy", "--quiet", "--checks=-bugprone-suspicious-include", source, "--", *self.flags],
                              cwd=self.top, capture_output=True, text=True, check=False)
        part = log.with_suffix(".part")
        part.write_text(done.stdout, encoding="utf-8")
        part.rename(log)


def main():
    tidy = Tidy(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
    found = {}
    for text in tidy.run(sys.argv[3:]):
        found.update(dict.fromkeys(report.rstrip() for report in REPORT.split(text)[1:]))
    print("\n".join(found))
    print(f"tidy.sh: {len(found)} findings", file=sys.stderr)
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
