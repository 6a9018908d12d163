"""Edits that a forger, a disk or a careless program makes: of JSON with arrays in hexadecimal, its text, its files."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Sequence
from copy import deepcopy
from typing import Any

import numpy as np

Random = np.random.Generator
Array = np.ndarray[Any, np.dtype[Any]]
Way = tuple[Any, Any]  # a container, and the key or index in it

NUMBERS = [
    0, 1, -1, 2, 7, 1.0, 50.7, True, False, None, "", "0", "5", 2**53, 2**53 + 1, 10**30, -(2**63), [], {}, [0],
    "9" * 400,
]  # fmt: skip
WORDS = [
    "0", "nan", "inf", "-inf", "-0x0.0p+0", "0x0.0p+0", "0x1p+0", "0x1.0p+0", "-0x1.8p-3", "0x1.8p+4",
    "0x0.0000000000001p-1022", "0x1.fffffffffffffp+1023", "0x1.0p+1024", "0x1.0p+9999", "0x1.00000000000001p+0",
    "0x1.ABp+0", "0X1.0P+0", "1.0", "1e5", "50", "Infinity", "0x1.0p0", " 0x1.0p+0", "0x1.0p+0\n", "0x\u0661.0p+0",
    "\uff10", "x", "0x2.0p+0", "+0x1.0p+0",
]  # fmt: skip
STARTS = ["first", "largest", "assumed", "readings", "physical", "later"]
STEPS = ["upper", "lower", "x", "s", "alarm", "start", "channels", "chain"]
NAMES = ["nominal", "sensor", "motor", "nobody", "", "nominal ", "Nominal"]
LITERALS = [
    "NaN", "Infinity", "-Infinity", "1e999", "1E2", "01", "+1", "0x10", "1_0", "\u0663", "true", "5.0", "-0",
    "9" * 5000,
]  # fmt: skip


def ways(value: Any, wanted: Callable[[Any], bool]) -> list[Way]:
    """Where such values stand in a tree of JSON."""
    entries = (
        list(value.items()) if isinstance(value, dict) else list(enumerate(value)) if isinstance(value, list) else []
    )
    found = [(value, key) for key, entry in entries if wanted(entry)]
    return found + [way for _, entry in entries for way in ways(entry, wanted)]


def one_of(items: Sequence[Any], rng: Random) -> Any:
    return items[int(rng.integers(len(items)))]


def is_array(value: Any) -> bool:
    return isinstance(value, dict) and set(value) == {"shape", "hex"} and isinstance(value["hex"], str)


def edit_words(
    change: Callable[[str, list[str], Random], str], all_of_them: float = 0.0
) -> Callable[[Any, Random], None]:
    """An edit of one word of an array, or of all."""

    def edit(tree: Any, rng: Random) -> None:
        places = ways(tree, lambda value: is_array(value) and value["hex"])
        if not places:
            return
        parent, key = one_of(places, rng)
        words = parent[key]["hex"].split(" ")
        chosen = range(len(words)) if rng.random() < all_of_them else [int(rng.integers(len(words)))]
        for i in chosen:
            words[i] = change(words[i], words, rng)
        parent[key]["hex"] = " ".join(words)

    return edit


def sign(word: str, _: list[str], __: Random) -> str:
    return word if word in ("0", "nan") else word[1:] if word.startswith("-") else "-" + word


def exponent(word: str, _: list[str], rng: Random) -> str:
    head, p, power = word.partition("p")
    return (
        f"{head}p{int(power) + int(rng.choice([-1000, -60, -4, -1, 1, 4, 60, 1000])):+d}"
        if p and power.lstrip("+-").isdigit()
        else word
    )


def scaled(word: str, _: list[str], rng: Random) -> str:
    try:
        return (float.fromhex(word) * float(rng.choice([0.0, 0.5, 0.9, 0.999, 1.001, 1.1, 2.0, 1e6]))).hex()
    except (ValueError, OverflowError):
        return word


def any_word(_: str, words: list[str], rng: Random) -> str:
    return str(one_of(WORDS, rng)) if rng.random() < 0.7 else str(one_of(words, rng))


def edit_integer(tree: Any, rng: Random) -> None:
    """An index, count or number one further, or anything."""
    places = ways(tree, lambda value: type(value) in (int, bool))
    if places:
        parent, key = one_of(places, rng)
        near = int(parent[key]) + int(rng.choice([-2, -1, 1, 2]))
        parent[key] = near if rng.random() < 0.7 else one_of(NUMBERS, rng)


def edit_text(tree: Any, rng: Random) -> None:
    places = ways(tree, lambda value: isinstance(value, str))
    if places:
        parent, key = one_of(places, rng)
        parent[key] = one_of(
            [*STARTS, *NAMES, "upper", "lower", "x", "s", "alarm", "start", "channels", "chain", *WORDS], rng
        )


def edit_entry(tree: Any, rng: Random) -> None:
    """Any entry is anything."""
    places = ways(tree, lambda _: True)
    if places:
        parent, key = one_of(places, rng)
        parent[key] = deepcopy(one_of([*NUMBERS, *(p[k] for p, k in places[:40])], rng))


def drop_entry(tree: Any, rng: Random) -> None:
    places = ways(tree, lambda _: True)
    if places:
        parent, key = one_of(places, rng)
        del parent[key]


def exchange_entries(tree: Any, rng: Random) -> None:
    """Two arrays in each other's place: lower and upper, channels, template and gain."""
    places = ways(tree, is_array)
    if len(places) > 1:
        (a, i), (b, j) = one_of(places, rng), one_of(places, rng)
        a[i], b[j] = b[j], a[i]


def edit_list(tree: Any, rng: Random) -> None:
    """Items exchanged, doubled, dropped, moved: samples, cells, steps, channels."""
    places = [(tree, None)] if isinstance(tree, list) else []
    places += ways(tree, lambda value: isinstance(value, list) and len(value) > 1)
    if not places:
        return
    parent, key = one_of(places, rng)
    items = parent if key is None else parent[key]
    if not items:
        return
    i, j = (int(rng.integers(len(items))) for _ in range(2))
    match int(rng.integers(5)):
        case 0:
            items[i], items[j] = items[j], items[i]
        case 1:
            items.insert(i, deepcopy(items[j]))
        case 2:
            del items[i]
        case 3:
            items.insert(i, items.pop(j))
        case _:
            rng.shuffle(items)


def shift(tree: Any, rng: Random) -> None:
    """All sample numbers of a part by as much."""
    by = int(rng.choice([-3, -1, 1, 2]))
    names = {"sample", "first", "last", "largest_at"}
    chosen = names if rng.random() < 0.5 else {one_of(sorted(names), rng)}
    for parent, key in ways(tree, lambda value: type(value) is int):
        if key in chosen:
            parent[key] += by


EDITS: dict[str, Callable[[Any, Random], None]] = {
    "sign": edit_words(sign, 0.3),
    "exponent": edit_words(exponent, 0.1),
    "scale": edit_words(scaled, 0.3),
    "word": edit_words(any_word, 0.05),
    "integer": edit_integer,
    "text": edit_text,
    "entry": edit_entry,
    "dropped": drop_entry,
    "exchanged": exchange_entries,
    "list": edit_list,
    "shift": shift,
}


def forged(tree: Any, rng: Random, more: dict[str, Callable[[Any, Random], None]]) -> tuple[str, Any]:
    """A copy with one to three edits, and the kind of the first."""
    tree, first, known = deepcopy(tree), "", EDITS | more
    for _ in range(int(rng.choice([1, 1, 2, 3]))):
        kind = str(one_of(sorted(known), rng))
        first = first or kind
        known[kind](tree, rng)
    return first, tree


# -- text and files ----------------------------------------------------------------------------------------------------


def doubled_key(line: str, rng: Random) -> str:
    """An entry that stands twice, with another value first: some parsers keep that one."""
    whole = [json.loads(line)]
    places = ways(whole, lambda value: isinstance(value, dict) and value)
    parent, at = one_of(places, rng)
    part = parent[at]
    key = str(one_of(sorted(part), rng))
    mark = "\x00"
    parent[at] = (
        {mark: one_of(NUMBERS[:10], rng), **part} if rng.random() < 0.5 else {**part, mark: one_of(NUMBERS[:10], rng)}
    )
    return json.dumps(whole[0]).replace(json.dumps(mark), json.dumps(key))


def literal(line: str, rng: Random) -> str:
    """A number in a form that JSON does not have, or another integer has."""
    places = [i for i, c in enumerate(line) if c.isdigit() and line[i - 2 : i] in (": ", ", ", " [")]
    if not places:
        return line
    at = one_of(places, rng)
    end = next((i for i in range(at, len(line)) if not line[i].isdigit()), len(line))
    return line[:at] + str(one_of(LITERALS, rng)) + line[end:]


def around(line: str, rng: Random) -> str:
    return str(
        one_of(
            [
                "\ufeff" + line,
                line + "\r",
                "\r" + line,
                line + "\x00",
                line + " x",
                line + "{}",
                "\xa0" + line,
                line.replace(": ", ":\u2003", 1),
            ],
            rng,
        )
    )


TEXT: dict[str, Callable[[str, Random], str]] = {"doubled key": doubled_key, "literal": literal, "around": around}


def file_of(lines: Sequence[str], rng: Random, is_packed: bool) -> tuple[str, bytes]:
    """The lines as a file: as it should be, or cut into members, in another coding, with bytes behind."""
    whole = [line + "\n" for line in lines]
    match int(rng.integers(30)):
        case 0:
            return "coding", "".join(whole).encode(str(one_of(["utf-16", "utf-32", "utf-8-sig", "utf-16-le"], rng)))
        case 1 if is_packed:
            members = [gzip.compress(line.encode()) for line in whole]
            rng.shuffle(members)
            return "members", b"".join(members)
        case 2 if is_packed:
            return "behind", gzip.compress("".join(whole).encode()) + bytes(rng.integers(0, 256, 9).tolist())
        case 3 if is_packed:
            return "zeros behind", gzip.compress("".join(whole).encode()) + bytes(64)
        case 4:
            return "ends", "\r\n".join(lines).encode(errors="surrogatepass")
    text = "".join(whole).encode(errors="surrogatepass")
    return "", gzip.compress(text, 1) if is_packed else text
