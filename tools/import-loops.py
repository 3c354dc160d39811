#!/usr/bin/env python3
"""Finds loops of imports between the files of a crate.

A file imports another when it names something that stands there, by `use` or by a path, also through a re-export of
`lib.rs` or of a folder's own file. Tests do not count. Prints each loop, and exits with 1 if there is one that `KNOWN` does not
hold.

    tools/import-loops.py [CRATE_FOLDER ...]      all crates of the workspace without an argument
"""

import re
import sys
from pathlib import Path

# Files of the loops that are still to be opened, by crate. A loop that is not here, or has grown, is a failure.
KNOWN = {"gradus-firmware": [3, 13], "gradus-sim": [2, 3]}

ITEM = re.compile(
    r"^(?:pub(?:\([^)]*\))?\s+)?(?:const\s+|async\s+)?(?:struct|enum|union|trait|type|fn|const|static(?:\s+mut)?|macro_rules!)\s+(\w+)",
    re.M)
PATH = re.compile(r"\b((?:crate|super|self)(?:::\w+)+)")


def code_of(path):
    """The text of a file without comments, strings and test modules."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/", "", path.read_text(), flags=re.S)
    text = re.sub(r'"(?:\\.|[^"\\])*"', '""', text, flags=re.S)
    tests = re.search(r"^#\[cfg\(test\)\]\s*(?:pub(?:\([^)]*\))?\s+)?mod\s+\w+\s*\{", text, re.M)
    return text[:tests.start()] if tests else text


def names_of_use(tree, prefix=()):
    """The paths that a `use` tree brings in, each with the name under which it is known."""
    tree = tree.strip()
    group = re.fullmatch(r"(?s)((?:\w+\s*::\s*)*)\{(.*)\}", tree)
    if group:
        head = prefix + tuple(re.findall(r"\w+", group[1]))
        depth, part = 0, ""
        for character in group[2] + ",":
            if character == "," and depth == 0:
                if part.strip():
                    yield from names_of_use(part, head)
                part = ""
                continue
            depth += (character == "{") - (character == "}")
            part += character
        return
    path, _, alias = tree.partition(" as ")
    words = prefix + tuple(re.findall(r"\w+|\*", path))
    if words and words[-1] == "self":
        words = words[:-1]
    if words:
        yield words, alias.strip() or words[-1]


class Crate:
    """The modules of a crate: where each name of each file really stands."""

    def __init__(self, folder):
        self.files = {}
        source = folder / "src"
        for path in sorted(source.rglob("*.rs")):
            parts = path.relative_to(source).with_suffix("").parts
            if "tests" in parts or "bin" in parts:
                continue
            parts = parts[:-1] if parts[-1] in ("lib", "main", "mod") else parts
            self.files[parts] = path.relative_to(folder)
        self.code = {module: code_of(folder / path) for module, path in self.files.items()}
        self.items = {module: set(ITEM.findall(code)) for module, code in self.code.items()}
        self.uses = {module: self.uses_of(module, code) for module, code in self.code.items()}

    def uses_of(self, module, code):
        return [(self.absolute(module, words), name, bool(public))
                for public, tree in re.findall(r"(\bpub(?:\([^)]*\))?\s+)?\buse\s+([^;]+);", code)
                for words, name in names_of_use(tree)]

    def absolute(self, module, words):
        """A path from the root of the crate; `None` for one that leads to another crate."""
        if words[0] == "crate":
            return words[1:]
        if words[0] in ("self", "super"):
            while words and words[0] in ("self", "super"):
                module = module[:-1] if words[0] == "super" else module
                words = words[1:]
            return module + words
        return module + words if module + words[:1] in self.files else None

    def home(self, words, seen=frozenset()):
        """The module in whose file the thing at a path stands."""
        if words is None or words in seen:
            return None
        length = max((n for n in range(len(words) + 1) if words[:n] in self.files), default=0)
        module, rest = words[:length], words[length:]
        if not rest or rest[0] == "*" or rest[0] in self.items[module]:
            return module
        for target, name, _ in self.uses[module]:
            if target is not None and name == rest[0]:
                return self.home(target, seen | {words})
            if target and name == "*":
                found = self.home(target[:-1] + rest[:1], seen | {words})
                if found and rest[0] in self.items[found]:
                    return found
        return module

    def imports(self):
        """The modules that each module imports."""
        edges = {}
        for module, code in self.code.items():
            paths = [self.absolute(module, tuple(path.split("::"))) for path in PATH.findall(code)]
            paths += [path for path, _, re_exported in self.uses[module] if not re_exported]
            edges[module] = {self.home(path) for path in paths if path} - {None, module}
        return edges

    def loops(self):
        """The groups of files that import each other in a circle."""
        edges = self.imports()
        reached = {module: reachable(module, edges) for module in edges}
        groups = {frozenset(other for other in reached[module] if module in reached[other])
                  for module in edges if module in reached[module]}
        return sorted(sorted(str(self.files[module]) for module in group) for group in groups)


def reachable(start, edges):
    found, waiting = set(), [start]
    while waiting:
        for target in edges.get(waiting.pop(), ()):
            if target not in found:
                found.add(target)
                waiting.append(target)
    return found


def main():
    root = Path(__file__).resolve().parent.parent
    folders = [Path(name) for name in sys.argv[1:]] or sorted(path.parent for path in root.glob("crates/*/Cargo.toml"))
    loops = [(folder.name, loop) for folder in folders for loop in Crate(folder).loops()]
    for crate, loop in loops:
        print(f"{crate}: loop of {len(loop)} files: {', '.join(loop)}")
    return 1 if any(not is_known(crate, [loop for of, loop in loops if of == crate]) for crate, _ in loops) else 0


def is_known(crate, loops):
    """True if the loops of a crate are no more and no larger than the known ones."""
    known = sorted(KNOWN.get(crate, []), reverse=True)
    sizes = sorted((len(loop) for loop in loops), reverse=True)
    return len(sizes) <= len(known) and all(size <= limit for size, limit in zip(sizes, known))


if __name__ == "__main__":
    sys.exit(main())
