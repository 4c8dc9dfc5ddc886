"""Reads our CDR with rosbags, writes it again, and says what it read. Called by suite/rosbags.rs.

Input: one JSON object on standard input.
    packages  {package: folder with msg/, srv/, action/}
    samples   [{type, cdr}]: our bytes, as hex
    bag       optional: a bag folder whose messages are to be read as well
Output: one JSON object on standard output.
    results   [{type, little, big, value}] for each sample: rosbags' bytes in both byte orders, and the value
    standard  [{type, ours, theirs}] for each message that rosbags ships: RIHS01 digest and constants of each side
    missing   names of our standard messages that rosbags does not ship
    bag       [{type, little, big, value}] for the messages of the bag, `little` as stored
"""

import dataclasses
import json
import sys
from pathlib import Path

import numpy
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

SUFFIXES = {"msg": [""], "srv": ["_Request", "_Response"], "action": ["_Goal", "_Result", "_Feedback"]}


def read_package(package, folder):
    """Reads every part of every interface as a message; rosbags itself knows only .msg files."""
    types = {}
    for kind, suffixes in SUFFIXES.items():
        for path in sorted(Path(folder, kind).glob(f"*.{kind}")):
            sections = [[]]
            for line in path.read_text().splitlines():
                if line.strip() == "---":
                    sections.append([])
                else:
                    sections[-1].append(line)
            for suffix, section in zip(suffixes, sections, strict=True):
                name = f"{package}/{kind}/{path.stem}{suffix}"
                # rosbags accepts only msg and action as the middle part while it parses.
                parsed = get_types_from_msg("\n".join(section), f"{package}/msg/{path.stem}{suffix}")
                types[name] = next(iter(parsed.values()))
    return types


def plain(value):
    """A message as JSON values. numpy numbers become Python's; constants, which rosbags also makes fields, go."""
    if dataclasses.is_dataclass(value):
        names = [field.name for field in dataclasses.fields(value) if field.name[0].islower()]
        return {name.rstrip("_"): plain(getattr(value, name)) for name in names}
    if isinstance(value, numpy.ndarray):
        return value.tolist()
    if isinstance(value, list):
        return [plain(item) for item in value]
    if isinstance(value, numpy.generic):
        return value.item()
    return value


def transcode(store, type_name, stored):
    message = store.deserialize_cdr(stored, type_name)
    return {
        "type": type_name,
        "little": bytes(store.serialize_cdr(message, type_name, little_endian=True)).hex(),
        "big": bytes(store.serialize_cdr(message, type_name, little_endian=False)).hex(),
        "value": plain(message),
    }


def describe(store, type_name):
    constants = [[name, kind, value] for name, kind, value in store.fielddefs[type_name][0]]
    return {"digest": store.hash_rihs01(type_name), "constants": constants}


def compare_standard(ours, packages):
    theirs = get_typestore(Stores.ROS2_JAZZY)
    names = [name for name in ours.fielddefs if name.split("/")[0] in packages]
    shipped = [name for name in names if name in theirs.fielddefs]
    standard = [{"type": n, "ours": describe(ours, n), "theirs": describe(theirs, n)} for n in shipped]
    return standard, sorted(set(names) - set(shipped))


def read_bag(folder):
    store = get_typestore(Stores.ROS2_JAZZY)
    with AnyReader([Path(folder)], default_typestore=store) as reader:
        for connection, _, stored in reader.messages():
            yield {**transcode(store, connection.msgtype, stored), "little": bytes(stored).hex()}


def main():
    request = json.load(sys.stdin)
    store = get_typestore(Stores.EMPTY)
    for package, folder in request["packages"].items():
        store.register(read_package(package, folder))
    standard, missing = compare_standard(store, request["packages"])
    reply = {
        "results": [transcode(store, s["type"], bytes.fromhex(s["cdr"])) for s in request["samples"]],
        "standard": standard,
        "missing": missing,
        "bag": list(read_bag(request["bag"])) if request.get("bag") else [],
    }
    json.dump(reply, sys.stdout)


if __name__ == "__main__":
    main()
