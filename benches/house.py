"""Measures how the sources are built, to compare commits: lines, circles between files, longest functions, test programs, and
what additions touched that were each made once on a throwaway branch. Needs git and Python 3.11.

    python3 benches/house.py                    # this checkout
    python3 benches/house.py 1ed785e main       # two commits, side by side
    python3 benches/house.py --added 1ed785e effect=old-effect search=old-search
    python3 benches/house.py --uses src/card    # what each file there uses, to check by hand
    python3 benches/house.py --circles          # only the circles of this checkout; ends with an error where there are any

A file uses another where it names what is defined there, in a `use` or by a path in its code. Re-exports lead to the file of
the definition, and are no use themselves unless the file's own code has the name. Calls of methods do not count, nor do
tests. A circle is a set of files of which each uses each other, directly or through others of the set.
"""

import argparse
import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path, PurePath

# Comments, and literals in which brackets mean nothing.
STRING = r"""b?r(?P<hash>#*)".*?"(?P=hash)|b?"(?:\\.|[^"\\])*"|b?'(?:\\(?:u\{[^}]*\}|x..|.)|[^\\'])'"""
LITERAL = re.compile(r"(?P<comment>//[^\n]*|/\*.*?\*/)|" + STRING, re.S)
TEST = re.compile(r"#\[cfg\((?:all\()?test\b[^\]]*\]")
USE = re.compile(r"(\bpub(?:\([^)]*\))?\s+)?\buse\s+([^;]+);")
GROUP = re.compile(r"([\w:]*)\{([^{}]*)\}")
MODULE = re.compile(r"\bmod\s+(\w+)\s*;")
INNER_MODULE = re.compile(r"\bmod\s+\w+\s*\{")
ITEM = re.compile(r"\b(?:fn|struct|enum|trait|type|const|static|union|macro_rules!)\s+(?:mut\s+)?(\w+)")
PATH = re.compile(r"(?<![\w:.])\w+(?:\s*::\s*\w+)+")
CRATES, MACROS = {}, {}


def block_end(code, start):
    depth = 0
    for match in re.compile(r"[{}]").finditer(code, start):
        depth += 1 if match[0] == "{" else -1
        if depth == 0:
            return match.end()


def leaves(tree):
    """The paths of a `use` and the names that they get: `a::{b, c as d}` gives (a::b, b) and (a::c, d)."""
    tree = re.sub(r"\s", "", re.sub(r"\s+as\s+", "=", tree))
    while GROUP.search(tree):
        tree = GROUP.sub(lambda group: ",".join(group[1] + part for part in group[2].split(",") if part), tree)
    for leaf in tree.split(","):
        path, _, name = leaf.removeprefix("::").partition("=")
        path = path.removesuffix("::self").split("::")
        yield path, name or path[-1]


class Module:
    """A source file: its code without comments, literals and tests, and what the names in it stand for."""

    def __init__(self, folder, file, modules, parent=None):
        modules.append(self)
        self.file, self.parent, self.root = file, parent, parent.root if parent else self
        text = (folder / file).read_text()
        self.lines = text.count("\n")
        self.code = LITERAL.sub(lambda match: re.sub(r"[^\n]", " " if match["comment"] else '"', match[0]), text)
        while test := TEST.search(self.code):
            end = re.compile(r"[{;]").search(self.code, test.end())
            end = block_end(self.code, end.start()) if end[0] == "{" else end.end()
            self.lines -= self.code.count("\n", test.start(), end) + 1
            self.code = self.code[: test.start()] + re.sub(r"[^\n]", " ", self.code[test.start() : end]) + self.code[end:]
        # What is above a module inside this file is this file.
        for inner in INNER_MODULE.finditer(self.code):
            end = block_end(self.code, inner.start())
            block = re.sub(r"\bsuper\b", "self ", self.code[inner.start() : end])
            self.code = self.code[: inner.start()] + block + self.code[end:]
        self.uses = [(use[1], *leaf) for use in USE.finditer(self.code) for leaf in leaves(use[2])]
        self.imports = {name: path for _, path, name in self.uses if name != "*"}
        self.body = MODULE.sub("", USE.sub("", self.code))
        self.items, self.children = set(ITEM.findall(self.body)), {}
        MACROS.update((name, file) for name in re.findall(r"\bmacro_rules!\s+(\w+)", self.body))
        inner = file.parent if file.stem in ("lib", "main", "mod") else file.with_suffix("")
        # Modules that a macro declares: all that are there.
        there = [path.stem for path in (folder / inner).glob("*.rs")] if re.search(r"\bmod\s+\$", self.code) else []
        for name in {*MODULE.findall(self.code), *there} - {"mod"}:
            path = inner / f"{name}.rs" if (folder / inner / f"{name}.rs").exists() else inner / name / "mod.rs"
            self.children[name] = Module(folder, path, modules, self)

    def lookup(self, name, last, seen):
        """The file that defines `name`, or the module of that name, which comes first where a path goes on; else None."""
        if (self, name, last) in seen:
            return None
        seen = seen | {(self, name, last)}
        found = self.children.get(name)
        if found and not last:
            return found
        if name in self.imports:
            found = self.resolve(self.imports[name], last, seen) or found
        elif name in self.items:
            found = self.file
        globs = (self.resolve(path[:-1], False, seen) for _, path, glob in self.uses if glob == "*")
        inner = (base.lookup(name, last, seen) for base in globs if isinstance(base, Module))
        return found or next(filter(None, inner), None)

    def resolve(self, path, last=True, seen=frozenset()):
        """What a path leads to: the file of an item, a module, or None for what is another crate's."""
        starts = {"crate": self.root, "self": self, "super": self.parent} | CRATES
        at = starts.get(path[0]) or self.lookup(path[0], last and len(path) == 1, seen)
        for index, name in enumerate(path[1:], 2):
            if isinstance(at, Module):
                at = at.parent if name == "super" else at.lookup(name, last and index == len(path), seen) or at.file
        return at

    def used(self):
        """The files that this one uses."""
        words = set(re.findall(r"(?<![\w.])\w+\b(?!\s*::)", self.body))
        is_module = lambda path: isinstance(self.resolve(path, False), Module)
        paths = [path for public, path, name in self.uses if name in words or not (public or name == "*" or is_module(path))]
        paths += [re.split(r"\s*::\s*", path) for path in PATH.findall(self.body)]
        paths += [[word] for word in words if any(name == "*" for _, _, name in self.uses)]
        found = {self.resolve(path) for path in paths}
        found |= {MACROS.get(name) for name in re.findall(r"\b(\w+)!", self.body) if name not in self.imports}
        return {file for file in found if isinstance(file, PurePath)} - {self.file}

    def functions(self):
        for found in re.finditer(r"\bfn\s+(\w+)", self.code):
            body = re.compile(r"\{|;(?![^\[\n]*\])").search(self.code, found.end())
            if body and body[0] == "{":
                yield self.code.count("\n", found.start(), block_end(self.code, body.start())) + 1, found[1], self.file


def test_programs(folder, manifest):
    found = {folder / test.get("path", f"tests/{test['name']}.rs") for test in manifest.get("test", [])}
    automatic = ("tests/*.rs", "tests/*/main.rs") if manifest.get("package", {}).get("autotests", True) else ()
    return len(found.union(*map(folder.glob, automatic)))


def measured(folder):
    """What each file uses, and the rows of the table, for a checkout."""
    read = lambda crate: tomllib.loads((folder / crate / "Cargo.toml").read_text())
    members = [".", *read(".").get("workspace", {}).get("members", [])]
    crates = [PurePath(member) for member in members if not member.startswith("tests/")]
    sources = [file.read_text() for crate in crates for file in (folder / crate / "src").rglob("*.rs")]
    CRATES.clear(), MACROS.clear()
    modules = []
    for root in (crate / "src" / name for crate in crates for name in ("lib.rs", "main.rs")):
        if (folder / root).exists():
            module = Module(folder, root, modules)
            if root.stem == "lib":
                CRATES[read(root.parent.parent)["package"]["name"].replace("-", "_")] = module
    uses = {module.file: module.used() for module in modules}
    reached = {file: set(own) for file, own in uses.items()}
    for between in uses:
        for own in reached.values():
            own |= reached[between] if between in own else set()
    circles = {tuple(sorted(other for other in own if file in reached[other])) for file, own in reached.items()} - {()}
    longest = sorted((one for module in modules for one in module.functions()), reverse=True)
    return uses, {
        "files of `src`": len(sources),
        "lines of `src`": sum(text.count("\n") for text in sources),
        "without tests": sum(module.lines for module in modules),
        "and without comments and blank lines": sum(bool(line.strip()) for one in modules for line in one.code.split("\n")),
        "circles between files": len(circles),
        "files in circles": sum(map(len, circles)),
        "the circles": "<br>".join(", ".join(f"`{file}`" for file in circle) for circle in sorted(circles)) or "none",
        "longest functions, lines": "<br>".join(f"{lines} `{name}` in `{file}`" for lines, name, file in longest[:3]),
        "integration-test programs": sum(test_programs(folder / member, read(member)) for member in members),
    }


def added(base, branches):
    """The table of what additions touched since the commit `base`, and the files of each."""
    print("| to add | sources: files | lines | tests: files | lines | docs: files | lines |\n" + "|---" * 7 + "|")
    lists = ""
    for name, branch in (addition.split("=", 1) for addition in branches):
        rows = {"sources": [], "tests": [], "docs": []}
        diff = subprocess.check_output(["git", "diff", "--numstat", "--no-renames", f"{base}...{branch}"], text=True)
        for line in diff.splitlines():
            plus, minus, file = line.split("\t")
            tests = "tests" if file.startswith(("tests/", "benches/")) else "sources"
            rows["docs" if file.endswith(".md") else tests].append((int(plus), int(minus), file))
        sums = [f"{len(own)} | +{sum(row[0] for row in own)} -{sum(row[1] for row in own)}" for own in rows.values()]
        print(f"| {name} | {' | '.join(sums)} |")
        lists += f"\n{name}:\n" + "".join(f"- `{file}` +{plus} -{minus}\n" for plus, minus, file in sum(rows.values(), []))
    print(lists)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commits", nargs="*")
    parser.add_argument("--added", nargs="+", metavar=("BASE", "NAME=BRANCH"))
    parser.add_argument("--uses", metavar="PATH")
    parser.add_argument("--circles", action="store_true")
    arguments = parser.parse_args()
    if arguments.circles:
        found = measured(Path("."))[1]["the circles"]
        return None if found == "none" else f"house.py: files that use each other in a circle:<br>{found}".replace("<br>", "\n")
    if arguments.added:
        return added(arguments.added[0], arguments.added[1:])
    columns = {}
    for commit in arguments.commits or ["checkout"]:
        with tempfile.TemporaryDirectory() as folder:
            if arguments.commits:
                subprocess.run(f"git archive {commit} | tar -x -C {folder}", shell=True, check=True)
            uses, columns[commit] = measured(Path(folder if arguments.commits else "."))
        for file in sorted(file for file in uses if arguments.uses and str(file).startswith(arguments.uses)):
            print(f"{file}: " + ", ".join(sorted(map(str, uses[file]))))
    print("| | " + " | ".join(columns) + " |\n" + "|---" * (len(columns) + 1) + "|")
    for row in next(iter(columns.values())):
        print(f"| {row} | " + " | ".join(str(column[row]) for column in columns.values()) + " |")


if __name__ == "__main__":
    sys.exit(main())
