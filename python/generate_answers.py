#!/usr/bin/env python3
"""Writes the dataclasses of ``rotor_edge/answers`` from the answer types of the program, ``host-sim/src/answers``.

    python/generate_answers.py            writes the files
    python/generate_answers.py --check    exits with 1 and names the files that are out of date

A class is called as its Rust type without the ending ``Answer``. Fields that are not serialized are left out."""

import keyword
import re
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "host-sim" / "src" / "answers"
TARGET = ROOT / "python" / "rotor_edge" / "answers"
WIDTH = 125

Added = tuple[str, str, str]
"""A field that Python adds, or puts in the place of one of the JSON: its name, annotation and meaning."""
ROTOR = ("rotor", "Rotor = field(kw_only=True)")
# the answer of a command by its Rust type, with the fields that Python adds
ANSWERS: dict[str, tuple[Added, ...]] = {
    "CheckAnswer": (),
    "PlanAnswer": (),
    "ComparisonAnswer": (),
    "DiagnosisAnswer": (),
    "Addition": ((*ROTOR, "The better model."),),
    "ImprovementAnswer": (("rotor", "Rotor | None = field(kw_only=True)", "The better model; None if it was not written."),),
    "Identification": ((*ROTOR, "The identified rotor."),),
    "SimulationAnswer": (("measurement", "Measurement = field(kw_only=True)", "The readings."),),
    "StartupAnswer": (("rotor", "Rotor | None", "The improved model, where one was asked for."),),
    "ForecastAnswer": (),
    "EstimatesAnswer": (),
    "MonitoredAnswer": (),
    "BalanceAnswer": (),
    "TrialBalance": (),
    "TrackAnswer": (
        (
            "csv",
            "str = field(kw_only=True, repr=False)",
            "Every estimate as a table, the file that ``forecast`` reads.",
        ),
    ),
    "ExtractionAnswer": (
        ("measurement", "Measurement = field(kw_only=True)", "The readings."),
        (
            "measurement_2x",
            "Measurement | None = field(kw_only=True)",
            "The vectors at twice the running speed, if they were wanted.",
        ),
    ),
    "ImportAnswer": (
        (
            "measurement",
            "Measurement | None = field(kw_only=True)",
            "The readings; None if nothing was to be written.",
        ),
    ),
    "ImportedRotorAnswer": (("rotor", "Rotor", "The drawing."),),
}
# members that Python adds
MEMBERS = {
    "TrackAnswer": '''
    @property
    def columns(self) -> dict[str, Array]:
        """The same table as arrays by name."""
        return columns_of(self.csv)'''
}
# parts of varying shape that Python takes as they are
OPAQUE = {"ForecastDay", "ScoreAnswer", "PinballAnswer", "IntervalAnswer"}
OPAQUE |= {"SamplingAnswer", "QualityAnswer", "PaperSamplers"}
# files with answers that Python has not
SKIPPED = {"mod", "monitor_result", "decode", "replay", "watch"}
NUMBERS = {"f64", "f32"}
PLAIN = {"f64": "float", "f32": "float", "bool": "bool", "String": "str", "&'static str": "str", "PathBuf": "str"}
PLAIN |= {"Value": "Any"}
PLAIN |= {f"{sign}{bits}": "int" for sign in "ui" for bits in ("8", "16", "32", "64", "size")}


@dataclass
class Field:
    """A field of a class: its JSON key, type, meaning, and whether an object may leave it out."""

    name: str
    hint: str
    doc: str
    optional: bool


@dataclass
class Class:
    """A class with the names of the types that it uses."""

    rust: str
    doc: str
    fields: list[Field]


@dataclass
class Alias:
    """Another name of a type."""

    name: str
    hint: str
    doc: str


def python_name(rust: str) -> str:
    """The class of a Rust type."""
    return rust.removesuffix("Answer")


def parts(text: str) -> list[str]:
    """Type arguments, split at the commas between them."""
    found, depth, start = [], 0, 0
    for at, letter in enumerate(text):
        depth += {"<": 1, "[": 1, ">": -1, "]": -1}.get(letter, 0)
        if letter == "," and depth == 0:
            found.append(text[start:at].strip())
            start = at + 1
    return [part for part in [*found, text[start:].strip()] if part]


def is_array(rust: str) -> bool:
    """Whether a type is a block of numbers of which every row is as long."""
    if match := re.fullmatch(r"\[(.+); *\w+\]", rust):
        return match[1] in NUMBERS or is_array(match[1])
    if match := re.fullmatch(r"Vec<(.+)>", rust):
        return match[1] in NUMBERS or match[1].startswith("[") and is_array(match[1])
    return False


def hint(rust: str) -> str:
    """The annotation of a Rust type."""
    rust = rust.strip()
    if rust in PLAIN:
        return PLAIN[rust]
    if is_array(rust):
        return "Array"
    if match := re.fullmatch(r"(\w+)<(.+)>", rust):
        outer, inner = match[1], parts(match[2])
        if outer == "Option":
            return f"{hint(inner[0])} | None"
        if outer == "Vec":
            return f"tuple[{hint(inner[0])}, ...]"
        if outer in ("BTreeMap", "ByName"):
            return f"dict[str, {hint(inner[-1])}]"
        raise ValueError(f"no annotation for {rust}")
    if rust in OPAQUE:
        return "dict[str, Any]"
    if re.fullmatch(r"\w+", rust):
        return python_name(rust)
    raise ValueError(f"no annotation for {rust}")


def fields(body: str) -> list[Field]:
    """The serialized fields of a struct."""
    found, doc, attributes = [], [], []
    for line in map(str.strip, body.splitlines()):
        if line.startswith("///"):
            doc.append(line[3:].strip())
        elif line.startswith("#["):
            attributes.append(line)
        elif match := re.fullmatch(r"pub (\w+): (.+),", line):
            serde = " ".join(attributes)
            if "serde(skip)" not in serde:
                key = re.search(r'rename = "(\w+)"', serde)
                name, optional = key[1] if key else match[1], "skip_serializing_if" in serde
                name += "_" if keyword.iskeyword(name) else ""
                found.append(Field(name, hint(match[2]), " ".join(doc), optional))
            doc, attributes = [], []
        elif line:
            raise ValueError(f"a line of a struct that is no field: {line}")
    return found


def read(path: Path) -> tuple[str, list[Alias | Class]]:
    """The meaning of a file, and its types in their order."""
    text = path.read_text()
    head = [line.removeprefix("//!").strip() for line in text.splitlines() if line.startswith("//!")]
    title = re.sub("`+", "``", " ".join(head[: head.index("") if "" in head else None]))
    found: list[Alias | Class] = []
    pattern = (
        r"(?P<doc>(?:^/// .*\n)*)(?P<attributes>(?:^#\[.*\]\n)*)"
        r"(?:^pub type (?P<alias>\w+) = (?P<type>.+);|^pub struct (?P<name>\w+) \{\n(?P<body>(?:.*\n)*?)^\})"
    )
    for match in re.finditer(pattern, text, re.MULTILINE):
        doc = " ".join(line.removeprefix("///").strip() for line in match["doc"].splitlines())
        if match["alias"]:
            found.append(Alias(match["alias"], hint(match["type"]), doc))
        elif match["name"] not in OPAQUE and re.search(r"derive\(.*\bSerialize\b", match["attributes"]):
            found.append(Class(match["name"], doc, fields(match["body"])))
    return title, found


def quoted(text: str, indent: str) -> str:
    """A docstring, wrapped."""
    wrapped = textwrap.wrap(f'"""{text}"""', WIDTH - len(indent), break_long_words=False)
    return "\n".join(indent + line for line in wrapped)


def names(hints: str) -> set[str]:
    """The words of annotations."""
    return set(re.findall(r"\w+", hints))


def ordered(types: list[Alias | Class]) -> list[Alias | Class]:
    """Each behind the ones it uses, for Python evaluates annotations in their order."""
    own = {t.name if isinstance(t, Alias) else python_name(t.rust): t for t in types}
    done: dict[str, Alias | Class] = {}

    def add(name: str) -> None:
        if name in done or name not in own:
            return
        of = own[name]
        hints = of.hint if isinstance(of, Alias) else " ".join(f.hint for f in of.fields)
        for used in re.findall(r"\w+", hints):
            if used != name:
                add(used)
        done[name] = of

    for name in own:
        add(name)
    return list(done.values())


def module(stem: str, where: dict[str, str], title: str, types: list[Alias | Class]) -> str:
    """The text of a file."""
    blocks, hints, classes = [], "", []
    for of in ordered(types):
        if isinstance(of, Alias):
            hints += f" {of.hint}"
            blocks.append(f"{of.name} = {of.hint}\n{quoted(of.doc, '')}\n")
            continue
        classes.append(of)
        added = {name: (annotation, doc) for name, annotation, doc in ANSWERS.get(of.rust, ())}
        is_answer = of.rust in ANSWERS
        lines = [
            f"@dataclass(frozen=True, eq=False{', repr=False' if is_answer else ''})",
            f"class {python_name(of.rust)}({'Answer' if is_answer else 'Record'}):",
            quoted(of.doc, "    "),
            "",
        ]
        # those that may be missing come last: they have a default
        for f in sorted(of.fields, key=lambda f: f.optional):
            annotation, doc = f"{f.hint}{' = None' if f.optional else ''}", f.doc
            annotation, doc = added.pop(f.name, (annotation, doc))
            hints += f" {annotation}"
            lines.append(f"    {f.name}: {annotation}")
            lines += [quoted(doc, "    ")] if doc else []
        for name, (annotation, doc) in added.items():
            hints += f" {annotation}"
            lines += [f"    {name}: {annotation}", quoted(doc, "    ")]
        if of.rust in MEMBERS:
            hints += f" {MEMBERS[of.rust]}"
            lines.append(MEMBERS[of.rust])
        blocks.append("\n".join(lines) + "\n")
    used = names(hints)
    own = {t.name if isinstance(t, Alias) else python_name(t.rust) for t in types}
    made = f"Written by ``python/generate_answers.py`` from ``host-sim/src/answers/{stem}.rs``."
    head = ['"""' + "\n".join(textwrap.wrap(title, WIDTH - 3)), "", f'{made}"""', ""]
    if classes:
        head.append(f"from dataclasses import dataclass{', field' if 'field' in used else ''}")
    head += ["from typing import Any"] if "Any" in used else []
    head.append("")
    inputs = sorted({"Measurement", "Rotor", "columns_of"} & used)
    head += [f"from ..inputs import {', '.join(inputs)}"] if inputs else []
    record = {"Array"} & used | {"Answer" if of.rust in ANSWERS else "Record" for of in classes}
    head += [f"from ..record import {', '.join(sorted(record))}"] if record else []
    for other in sorted({where[name] for name in used - own if where.get(name, stem) != stem}):
        head.append(f"from .{other} import {', '.join(sorted(n for n in used - own if where.get(n) == other))}")
    body = ""
    for before, block in zip(["", *blocks], blocks):
        is_class = block.startswith("@") or before.startswith("@") or not before
        body += ("\n\n" if is_class else "") + block
    return "\n".join(head) + "\n" + (body if body.startswith("\n\n@") else body[1:])


def generated() -> dict[Path, str]:
    """Every file with its text."""
    found = {path.stem: read(path) for path in sorted(SOURCE.glob("*.rs")) if path.stem not in SKIPPED}
    where = {
        t.name if isinstance(t, Alias) else python_name(t.rust): stem for stem, (_, types) in found.items() for t in types
    }
    return {
        TARGET / f"{stem}.py": module(stem, where, title, types) for stem, (title, types) in found.items() if types
    }


def main() -> int:
    files = generated()
    stale = [path for path, text in files.items() if not path.exists() or path.read_text() != text]
    if "--check" in sys.argv[1:]:
        for path in stale:
            print(f"{path.relative_to(ROOT)}: out of date, run python/generate_answers.py", file=sys.stderr)
        return 1 if stale else 0
    for path in stale:
        path.write_text(files[path])
        print(path.relative_to(ROOT))
    return 0


if __name__ == "__main__":
    sys.exit(main())
