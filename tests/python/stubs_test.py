"""The type stubs say what the module has: every name, every argument, and which arguments may be left out."""
import ast
import inspect
import pathlib
import re
import unittest

import gelslam

STUBS = ast.parse((pathlib.Path(gelslam.__file__).parent / "__init__.pyi").read_text())
NOT_CHECKED = {"__module__", "__doc__", "__dict__", "__weakref__", "__repr__", "__getstate__", "__setstate__",
               "__reduce_ex__", "__new__"}


def stub_arguments(function):
    """[(name, may be left out)] and which of them are keywords, of a definition in the stubs."""
    spec = function.args
    positional = spec.posonlyargs + spec.args
    defaults = [None] * (len(positional) - len(spec.defaults)) + spec.defaults
    arguments = [(a.arg, d is not None) for a, d in zip(positional, defaults) if a.arg != "self"]
    keywords = [(a.arg, d is not None) for a, d in zip(spec.kwonlyargs, spec.kw_defaults)]
    return arguments, keywords


def signatures(doc):
    """The same of what pybind11 writes into docstrings, one for each overload."""
    for line in re.findall(r"^(?:\d+\. )?\w+\((.*)\) -> .*$", doc, re.M):
        if line == "*args, **kwargs":
            continue
        arguments, keywords = [], []
        target = arguments
        for word in re.split(r", (?=\*|\w+:)", line):
            if word == "*":
                target = keywords
            elif word and not word.startswith("self:"):
                target.append((word.split(":")[0], " = " in word))
        yield arguments, keywords


class Stubs(unittest.TestCase):
    def definitions(self, body):
        named = {}
        for node in body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
                named.setdefault(node.name, []).append(node)
        return named

    def test_the_module_has_what_the_stubs_say_and_no_more(self):
        stubs = self.definitions(STUBS.body)
        if not hasattr(gelslam, "Camera"):
            del stubs["Camera"]
        self.assertEqual(set(stubs) | {"__version__"}, set(gelslam.__all__))
        assigned = {target.id for node in STUBS.body if isinstance(node, ast.Assign) for target in node.targets}
        self.assertEqual({name for name in assigned if not name.startswith("_")}, set(), "are not in the module")
        for name, nodes in stubs.items():
            if isinstance(nodes[0], ast.FunctionDef):
                self.compare(name, nodes, getattr(gelslam, name))
            elif name != "Error":
                self.compare_class(name, nodes[0])

    def compare_class(self, name, node):
        members = self.definitions(node.body)
        if not hasattr(gelslam.Map, "from_mesh"):
            members.pop("from_mesh", None)
        runtime = {key for key, value in vars(getattr(gelslam, name)).items()
                   if key not in NOT_CHECKED and not key.startswith("_pybind11")}
        if "__init__" not in members:  # pybind11 gives every class one, which refuses
            runtime.discard("__init__")
        self.assertEqual(runtime, set(members), name)
        for member, nodes in members.items():
            value = vars(getattr(gelslam, name))[member]
            is_property = isinstance(value, property)
            self.assertEqual(is_property, any(getattr(d, "id", "") == "property" for d in nodes[0].decorator_list),
                             f"{name}.{member}")
            if not member.startswith("__"):
                self.assertTrue(inspect.getdoc(value), f"{name}.{member} has no docstring")
            if isinstance(value, staticmethod):
                value = value.__func__
            if not is_property and member != "__exit__":
                self.compare(f"{name}.{member}", nodes, value)

    def compare(self, name, nodes, function):
        self.assertEqual([stub_arguments(node) for node in nodes], list(signatures(function.__doc__ or "")), name)


if __name__ == "__main__":
    unittest.main()
