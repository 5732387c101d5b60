"""The package itself: docstrings, stubs, and the lines of the README."""

import ast
import importlib.util
import inspect
import pathlib
import re

import foible3d

PACKAGE = pathlib.Path(foible3d.__file__).parent
README = pathlib.Path(__file__).parents[1] / "README.md"


def public(thing):
    return [name for name in vars(thing) if not name.startswith("_")]


def test_every_public_name_has_a_docstring():
    without = []
    for name in foible3d.__all__:
        thing = getattr(foible3d, name)
        if name == "__version__":
            continue
        names = [(name, thing)]
        if inspect.isclass(thing) and not issubclass(thing, BaseException):
            names += [(f"{name}.{member}", getattr(thing, member)) for member in public(thing)]
        without += [full for full, thing in names if not inspect.getdoc(thing) and not isinstance(thing, type)]
        # What a choice stands for is told by its class.
        without = [full for full in without if not full.split(".")[-1].isupper()]
    assert not without


def stub_members(node, classes):
    """Names of a class of the stub, those of its bases included."""
    own = {child.name for child in node.body if isinstance(child, ast.FunctionDef)}
    own |= {child.target.id for child in node.body if isinstance(child, ast.AnnAssign)}
    for base in node.bases:
        if isinstance(base, ast.Name) and base.id in classes:
            own |= stub_members(classes[base.id], classes)
    return {name for name in own if not name.startswith("_")}


def test_the_stub_tells_all_there_is_and_no_more():
    tree = ast.parse((PACKAGE / "_native.pyi").read_text())
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    native = [name for name in foible3d.__all__ if hasattr(foible3d._native, name) and name != "__version__"]
    assert {name for name in classes if not name.startswith("_")} | functions == set(native)
    for name in native:
        if inspect.isclass(getattr(foible3d, name)):
            assert stub_members(classes[name], classes) == set(public(getattr(foible3d, name))), name


def test_the_stub_tells_the_arguments():
    tree = ast.parse((PACKAGE / "_native.pyi").read_text())
    for node in tree.body:
        if not isinstance(node, ast.ClassDef) or node.name.startswith("_"):
            continue
        for child in node.body:
            if not isinstance(child, ast.FunctionDef) or child.name.startswith("__") or child.decorator_list:
                continue
            rest = [child.args.vararg] if child.args.vararg else []
            told = [argument.arg for argument in child.args.args + rest + child.args.kwonlyargs]
            signature = inspect.signature(getattr(getattr(foible3d, node.name), child.name))
            found = [name for name, p in signature.parameters.items() if p.kind != p.VAR_KEYWORD]
            assert told == found, f"{node.name}.{child.name}"


def test_options_are_the_methods_of_their_builders():
    tree = ast.parse((PACKAGE / "_native.pyi").read_text())
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    for options, builder in [
        ("_RigidBodyOptions", "RigidBodyBuilder"),
        ("_ColliderOptions", "ColliderBuilder"),
        ("_JointOptions", "JointBuilder"),
        ("_ShapeOptions", "DeformableBodyBuilder"),
    ]:
        assert stub_members(classes[options], classes) == set(public(getattr(foible3d, builder))), builder


def test_the_lines_of_the_readme_run(tmp_path, monkeypatch):
    # Where files are written.
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(), re.S)
    assert blocks
    names = {}
    for block in blocks:
        if "import gymnasium" in block and importlib.util.find_spec("gymnasium") is None:
            continue
        exec(compile(block, str(README), "exec"), names)
