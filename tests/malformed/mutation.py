"""Seeded mutations of files, by format: bytes, JSON, YAML, CSV, XML, Parquet and safetensors."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import yaml

from tests.malformed.map_mutation import mutate_map
from tests.malformed.map_pieces import WHOLE, piece

NUMBERS = (
    0, -1, 1, 2, 0.5, -0.0, 1e308, -1e308, 1e-320, 2**31, 2**53, 2**63, -(2**63) - 1, 10**25, 10**60,
    float("nan"), float("inf"), float("-inf"),
)  # fmt: skip
TEXTS = (
    "", " ", "a" * 5000, "\u0000", "\ud800", "ü\u202e\ufeff😀", "../../etc/passwd", "1", "nan", "null", "[", "é" * 300,
    "a\nb\r\nc", "%s{}$P1", "JTurn", "KFC", "participant", "os:X-v0", "10.0",
)  # fmt: skip


def value(random: Random, old: object) -> Any:
    """Returns a value in place of another one."""
    choice = random.random()
    if choice < 0.35:
        return random.choice(NUMBERS)
    if choice < 0.55:
        return random.choice(TEXTS)
    if choice < 0.65:
        return None
    if choice < 0.7:
        return random.choice((True, False))
    if choice < 0.8:
        return [old] if random.random() < 0.5 else {"value": old}
    if choice < 0.85:
        return str(old) if isinstance(old, int | float | bool) else old
    if choice < 0.9:
        nested: object = 1
        for _ in range(random.choice((30, 60, 500))):
            nested = [nested] if random.random() < 0.5 else {"a": nested}
        return nested
    if choice < 0.95:
        return [] if random.random() < 0.5 else {}
    if isinstance(old, int | float) and not isinstance(old, bool):
        return -old if random.random() < 0.5 else old * random.choice((10, 1000, 10**9)) + random.choice((0, 1, 0.5))
    return [old] * random.choice((2, 1000))


def change(node: Any, random: Random) -> Any:
    """Returns a JSON value with one change somewhere in it."""
    if isinstance(node, dict) and node and random.random() < 0.9:
        key = random.choice(list(node))
        choice = random.random()
        if choice < 0.75:
            node[key] = change(node[key], random)
        elif choice < 0.85:
            del node[key]
        elif choice < 0.9:
            node[random.choice(TEXTS)] = node[key]
        elif choice < 0.95:
            other = random.choice(list(node))
            node[key], node[other] = node[other], node[key]
        else:
            node[value(random, key) if random.random() < 0.1 else str(key).upper()] = node.pop(key)
        return node
    if isinstance(node, list) and node and random.random() < 0.9:
        place = random.randrange(len(node))
        choice = random.random()
        if choice < 0.75:
            node[place] = change(node[place], random)
        elif choice < 0.85:
            del node[place]
        elif choice < 0.95:
            node.insert(place, json.loads(json.dumps(node[random.randrange(len(node))], default=str)))
        else:
            random.shuffle(node)
        return node
    return value(random, node)


def dumped(node: Any, random: Random) -> str:
    """Returns JSON, at times with a field given twice."""
    text = json.dumps(node, ensure_ascii=random.random() < 0.5, default=str)
    if random.random() < 0.05 and (fields := list(re.finditer(r'"(\w+)": ', text))):
        field = random.choice(fields)
        text = f"{text[: field.start()]}{field[0]}{random.choice(('1', 'null', '[]'))}, {text[field.start() :]}"
    return text


def encoded(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")


def of_bytes(content: bytes, random: Random) -> bytes:
    """Flips, cuts, repeats, inserts."""
    if not content:
        return bytes(random.randrange(256) for _ in range(random.randrange(40)))
    for _ in range(random.choice((1, 1, 1, 2, 8))):
        place = random.randrange(len(content) + 1)
        part = random.randrange(1, 300)
        choice = random.randrange(6)
        if choice == 0:
            content = content[:place]
        elif choice == 1:
            content = content[:place] + content[place + part :]
        elif choice == 2:
            content = content[:place] + content[place : place + part] * random.choice((2, 50)) + content[place:]
        elif choice == 3:
            piece = encoded(random.choice((*TEXTS, "[" * 3000, "9" * 6000, "-1", "NaN", "1e999", '"', ",", "&a;", "<")))
            content = content[:place] + piece + content[place:]
        elif place < len(content):
            flipped = content[place] ^ (1 << random.randrange(8)) if choice == 4 else random.randrange(256)
            content = content[:place] + bytes([flipped]) + content[place + 1 :]
        content = content[:300_000]
    return content


def of_json(content: bytes, random: Random) -> bytes:
    node = json.loads(content)
    for _ in range(random.choice((1, 1, 2, 5))):
        node = change(node, random)
    return encoded(dumped(node, random))


def of_lines(content: bytes, random: Random) -> bytes:
    lines = content.splitlines()
    place = random.randrange(len(lines))
    choice = random.random()
    if choice < 0.8:
        lines[place] = of_json(lines[place], random)
    elif choice < 0.87:
        del lines[place]
    elif choice < 0.94:
        lines.insert(place, random.choice(lines))
    else:
        lines[place:place] = [lines[place]] * 3000
    return b"\n".join(lines) + b"\n"


def of_csv(content: bytes, random: Random) -> bytes:
    rows = [line.split(",") for line in content.decode().splitlines()]
    place = 0 if random.random() < 0.2 else random.randrange(len(rows))
    column = random.randrange(max(len(rows[place]), 1))
    choice = random.random()
    if choice < 0.6 and rows[place]:
        rows[place][column % len(rows[place])] = str(random.choice((*NUMBERS, *TEXTS)))
    elif choice < 0.7:
        rows[place].append(random.choice(rows[place] or ["x"]))
    elif choice < 0.8:
        del rows[place]
    elif choice < 0.9:
        rows.insert(place, list(random.choice(rows)))
    else:
        for row in rows:
            del row[column : column + 1]
    return encoded("\n".join(",".join(row) for row in rows) + "\n")


def of_yaml(content: bytes, random: Random) -> bytes:
    if random.random() < 0.15:
        return random.choice((b"a: &a [x]\n" + b"".join(b"b%d: &b%d [*a,*a]\n" % (k, k) for k in range(30)),
                              b"[" * 5000, b"{a: " * 2000, b"a: " + b"9" * 6000, b"? " * 3000))  # fmt: skip
    node = yaml.safe_load(content)
    for _ in range(random.choice((1, 1, 2, 5))):
        node = change(node, random)
    try:
        return encoded(yaml.safe_dump(node, sort_keys=False, allow_unicode=random.random() < 0.5))
    except (yaml.YAMLError, RecursionError):
        return of_bytes(content, random)


_ATTRIBUTE = re.compile(rb'([A-Za-z]\w*)="([^"]*)"')
_ELEMENT = re.compile(rb"<(\w+)\b[^<>]*/>")
_BOMB = (
    b'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">'
    + b"".join(b'<!ENTITY a%d "%s">' % (k, b"&a%s;" % (str(k - 1).encode() if k else b"") * 10) for k in range(12))
    + b"]><OpenDRIVE><road name='&a11;' length='1' id='1'/></OpenDRIVE>"
)


def of_map(content: bytes, random: Random) -> bytes:
    """Mutates a map by its elements or by its text; of a large map, a piece."""
    if len(content) > WHOLE:
        content = piece(content, random.choice((3, 8, 20, 40)), random)
    return mutate_map(content, random) if random.random() < 0.6 else of_xml(content, random)


def of_xml(content: bytes, random: Random) -> bytes:
    if random.random() < 0.02:
        return random.choice((_BOMB, b"<OpenDRIVE>" + b"<road>" * 3000, b"<OpenDRIVE/>"))
    for _ in range(random.choice((1, 1, 2, 5))):
        pattern = _ATTRIBUTE if random.random() < 0.75 else _ELEMENT
        found = list(pattern.finditer(content))
        if not found:
            return of_bytes(content, random)
        match = random.choice(found)
        if pattern is _ATTRIBUTE:
            new = encoded(str(random.choice((*NUMBERS, *TEXTS[:3], *TEXTS[7:9], 0, 1, -1, 3, 1e6, 1e9, 10, 1e-9))))
            replaced = b"" if random.random() < 0.1 else match[1] + b'="' + re.sub(rb'[<&"]', b"", new) + b'"'
        else:
            replaced = random.choice((b"", match[0] * 2, match[0] * 500))
        content = content[: match.start()] + replaced + content[match.end() :]
    return content


def of_parquet(content: bytes, random: Random) -> bytes:
    table = pq.read_table(pa.BufferReader(content))
    name = random.choice(table.column_names)
    place = table.column_names.index(name)
    choice = random.random()
    try:
        if choice < 0.15:
            table = table.drop_columns([name])
        elif choice < 0.25:
            table = table.rename_columns([random.choice(TEXTS[2:]) if k == name else k for k in table.column_names])
        elif choice < 0.3:
            table = table.append_column(name, table.column(name))
        elif choice < 0.4:
            table = pa.concat_tables([table.slice(0, random.randrange(table.num_rows + 1)), table])
        else:
            column = table.column(name).to_pylist()
            if random.random() < 0.5:
                new = value(random, column[0] if column else None)
                column = [new] * len(column)
            else:
                for _ in range(random.choice((1, 3))):
                    row = random.randrange(max(len(column), 1))
                    column[row] = change(json.loads(json.dumps(column[row], default=str)), random)
            table = table.set_column(place, name, pa.array(column))
    except (pa.ArrowException, OverflowError, IndexError, TypeError, ValueError):
        return of_bytes(content, random)
    sink = pa.BufferOutputStream()
    try:
        pq.write_table(table, sink, compression=random.choice(("zstd", "snappy", "none", "gzip")))
    except (pa.ArrowException, TypeError, ValueError):  # Parquet lacks the type
        return of_bytes(content, random)
    return sink.getvalue().to_pybytes()


def of_safetensors(content: bytes, random: Random) -> bytes:
    (size,) = struct.unpack_from("<Q", content)
    if random.random() < 0.1:
        return struct.pack("<Q", random.choice((0, 2**63, size * 2, 10**9))) + content[8:]
    if random.random() < 0.3:
        place = random.randrange(8 + size, len(content)) // 4 * 4
        return (
            content[:place]
            + struct.pack("<f", random.choice((float("nan"), float("inf"), 1e38)))
            + content[place + 4 :]
        )
    header = encoded(dumped(change(json.loads(content[8 : 8 + size]), random), random))
    return struct.pack("<Q", len(header)) + header + content[8 + size :]


BY_SUFFIX: dict[str, Callable[[bytes, Random], bytes]] = {
    ".json": of_json,
    ".jsonl": of_lines,
    ".csv": of_csv,
    ".yaml": of_yaml,
    ".xodr": of_map,
    ".parquet": of_parquet,
    ".safetensors": of_safetensors,
}


def mutate(file: Path, random: Random) -> None:
    """Replaces a file by a mutation of it."""
    content = file.read_bytes()
    known = BY_SUFFIX.get(file.suffix)
    if known is None or random.random() < 0.25:
        file.write_bytes(of_bytes(content, random))
        return
    try:
        file.write_bytes(known(content, random))
    except (ValueError, TypeError, RecursionError, OverflowError, UnicodeError):  # JSON or YAML lacks the value
        file.write_bytes(of_bytes(content, random))


def mutate_folder(folder: Path, random: Random) -> None:
    """Mutates, removes or empties one or two of the files in a folder."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    for file in random.sample(files, min(len(files), random.choice((1, 1, 1, 2)))):
        choice = random.random()
        if choice < 0.94:
            mutate(file, random)
        elif choice < 0.96:
            file.unlink()
        elif choice < 0.98:
            file.unlink()
            file.mkdir()
        else:
            other = random.choice(files)
            file.write_bytes(other.read_bytes() if other.is_file() else b"")
