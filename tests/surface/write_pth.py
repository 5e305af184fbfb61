#!/usr/bin/python3
"""write_pth.py SPEC.json FOLDER: the files inside an nnmodel.pth, as torch.save writes them.

PyTorch need not be there: Python's own pickle module writes stand-ins that have its names.
"""

import collections
import functools
import io
import json
import pathlib
import pickle
import struct
import sys
import types

FORMATS = {"torch FloatStorage": "f", "torch DoubleStorage": "d", "torch HalfStorage": "e", "torch LongStorage": "q"}


@functools.cache
def named(module_and_name):
    """A class that pickle finds under this name."""
    module, name = module_and_name.split()
    for package in (module.split(".")[0], module):
        sys.modules.setdefault(package, types.ModuleType(package))
    stand_in = type(name, (), {"__module__": module})
    setattr(sys.modules[module], name, stand_in)
    return stand_in


class Storage:
    def __init__(self, key, kind, values):
        self.id = ("storage", named(kind), str(key), "cpu", len(values))
        numbers = [float("nan") if value is None else value for value in values]
        self.bytes = struct.pack(f"<{len(values)}{FORMATS[kind]}", *numbers)


class Tensor:
    def __init__(self, spec, shape, storage):
        strides = [1] * len(shape)
        for i in reversed(range(len(shape) - 1)):
            strides[i] = strides[i + 1] * shape[i + 1]
        layout = (spec["storage_offset"], tuple(shape), tuple(strides))
        self.reduced = (named(spec["rebuild_function"]), (storage, *layout, False, collections.OrderedDict()))

    def __reduce__(self):
        return self.reduced


class Pickler(pickle.Pickler):
    def persistent_id(self, obj):
        return obj.id if isinstance(obj, Storage) else None


def contents(spec):
    """All tensors by name, and their storages."""
    tensors, storages = collections.OrderedDict(), []

    def add(name, shape, values, kind):
        storages.append(Storage(len(storages), kind, values))
        tensors[spec["prefix"] + name] = Tensor(spec, shape, storages[-1])

    kind = spec["storage_class"]
    for i, layer in enumerate(spec["layers"], 1):
        name, inputs, outputs = f"{spec['layer_name']}{i}", layer["inputs"], layer["outputs"]
        add(f"{name}.weight", [outputs, inputs] + [1, 1] * (spec["layer_name"] == "conv"), layer["weight"], kind)
        add(f"{name}.bias", [outputs], layer["bias"], kind)
        if i > len(spec["norms"]):
            continue
        for part in ("weight", "bias", "running_mean", "running_var"):
            add(f"bn{i}.{part}", [outputs], spec["norms"][i - 1][part], kind)
        add(f"bn{i}.num_batches_tracked", [], [7], "torch LongStorage")
    return tensors, storages


def main():
    spec, folder = json.loads(pathlib.Path(sys.argv[1]).read_text()), pathlib.Path(sys.argv[2])
    tensors, storages = contents(spec)
    if spec["with_metadata"]:
        tensors._metadata = {"version": 1}
    whole = tensors
    if spec["checkpoint"]:
        group = {"lr": 0.01, "foreach": None, "params": [0, 1]}
        whole = {"epoch": 31, spec["entry"]: tensors, "optimizer": {"state": {0: {}}, "param_groups": [group]}}
    text = io.BytesIO()
    Pickler(text, min(spec["protocol"], pickle.HIGHEST_PROTOCOL)).dump(whole)
    (folder / "data").mkdir(parents=True)
    (folder / "data.pkl").write_bytes(b"\x80" + bytes([spec["protocol"]]) + text.getvalue()[2:])
    for key, storage in enumerate(storages):
        (folder / "data" / str(key)).write_bytes(storage.bytes)


main()
