"""The workflow's configuration: checked against its schema, which also holds the defaults.

`python -m neumat.config workflow/schemas/config.schema.json` prints the table of all keys, config/README.md.
"""

import copy
import json
import math
import os
import sys
from pathlib import Path

import yaml
from jsonschema import Draft202012Validator
from jsonschema.validators import extend

from neumat.brdf.names import check_names, chosen_names, measured_files
from neumat.brdf.published import merl_checksums
from neumat.errors import NeumatError
from neumat.files import cause

SUFFIXES = {"merl": ".binary", "rgl": ".bsdf"}
FEWEST = 4  # sources: two on each side of a split


def _is_number(_, value):
    """YAML knows .nan and .inf, which no range check refuses."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


Validator = extend(Draft202012Validator, type_checker=Draft202012Validator.TYPE_CHECKER.redefine("number", _is_number))


def load(config, schema, what="config"):
    """Return `config` with the defaults of `schema` (a path) filled in, checked.

    Raises NeumatError naming the first wrong key of `what`.
    """
    return _checked(config, json.loads(Path(schema).read_text(encoding="utf-8")), what)


def _checked(config, schema, what):
    """Return `config` with the defaults of `schema`, its JSON read, filled in; as `load`."""
    config = _fill(config, schema)
    errors = sorted(Validator(schema).iter_errors(config), key=lambda error: error.json_path)
    if errors:
        raise _one_line(errors[0], what)
    return config


def load_scene(path, schema):
    """Return the layout of a scene's YAML file with the defaults of `schema` (a path) filled in, checked.

    Raises NeumatError for a missing file, one that is no YAML, and the first wrong key or number of masks.
    """
    layout = load(_read_yaml(path, "a scene's YAML file"), schema, path)
    for name, item in layout["objects"].items():
        expected, found = len(item["materials"]) - 1, len(item["masks"])
        if found != expected:
            raise NeumatError(f"{path}: key objects.{name}.masks", f"{expected}, one less than materials", found)
    return layout


def load_surface(path, schema, made=frozenset):
    """Return the config of a surface's YAML file with the defaults of `schema` (a path) and of its process filled in,
    checked. That of a measured surface has the key `file` in place of `process`.

    made: a function that returns the names of the materials that a run makes. Raises NeumatError for a missing file,
    one that is no YAML, the first wrong key, a measured file that is missing, and a material that is neither an
    embedded one, nor a file, nor made.
    """
    config = _read_yaml(path, "a surface's YAML file")
    schema = json.loads(Path(schema).read_text(encoding="utf-8"))
    if isinstance(config, dict) and "file" in config:
        config = _checked(config, schema["$defs"]["measured"], path)
        if not os.path.exists(config["file"]):
            raise NeumatError(f"{path}: key file", "a .btf file, or a folder or .zip of pictures", config["file"])
        return config
    process = config.get("process") if isinstance(config, dict) else None
    if isinstance(process, str) and process in schema["$defs"]:
        schema["properties"] |= schema["$defs"][process]["properties"]
    config = _checked(config, schema, path)
    for name in config["materials"]:
        if name not in merl_checksums() and not Path(name).is_file() and name not in made():
            expected = "names of embedded, fitted or sampled materials, or files"
            raise NeumatError(f"{path}: key materials", expected, repr(name))
    return config


def _read_yaml(path, what):
    """Return what a YAML file holds; raises NeumatError, which says that it should be `what`."""
    try:
        return yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise NeumatError(path, what, cause(path, error)) from error
    except RecursionError as error:
        raise NeumatError(path, what, "lists within lists, too deep to read") from error
    except (ValueError, yaml.YAMLError) as error:  # ValueError: bytes that are no text, dates that are none
        raise NeumatError(path, what, " ".join(str(error).split())) from error


def source_files(sources):
    """Return {name: path} of the user's own files, sorted by name, that the config's section `sources` asks for; none
    where there are none.

    Raises NeumatError where a folder is needed and missing, holds no file of the kind or one with a name that a
    material may not have, and for a folder or an address that the kind has no use for.
    """
    url = sources["url"]
    if url and (sources["kind"] != "merl" or "{name}" not in url):
        raise NeumatError("config key sources.url", "an address with {name} in it, and kind: merl", url)
    if sources["kind"] == "embedded":
        if sources["folder"]:
            raise NeumatError("config key sources.kind", "merl or rgl, the kind of files in sources.folder", "embedded")
        return {}
    folder, suffix = sources["folder"], SUFFIXES[sources["kind"]]
    if folder is None or not (url or os.path.isdir(folder)):
        raise NeumatError("config key sources.folder", f"a folder of {suffix} files", folder or "none")
    return {} if url else measured_files(folder, suffix)


def source_names(sources):
    """Return the names of the materials that the config's section `sources` asks for, without reading any.

    Raises NeumatError for names that are not at hand and for fewer than 4 of them.
    """
    available = source_files(sources) or merl_checksums()
    names = chosen_names(sorted(available) if sources["kind"] == "embedded" else available, sources["names"])
    names = names[: sources["count"]]
    if len(names) < FEWEST:
        where = sources["folder"] or "config key sources.names"
        raise NeumatError(where, f"at least {FEWEST} materials to split and blend", len(names))
    return names


def fit_files(fit):
    """Return the files of the folder that the config's section `fit` names as `measured`, sorted: measured materials,
    and the published fields (.h5) that have the name of one. An empty list where it is null.

    Raises NeumatError where it is no folder, or has fewer than two materials: some choose settings, others report.
    """
    folder, suffixes = fit["measured"], tuple(SUFFIXES.values())
    if folder is None:
        return []
    where, expected = "config key fit.measured", f"a folder of at least two {' and '.join(suffixes)} files"
    try:
        files = sorted(Path(folder).iterdir())
    except OSError as error:
        raise NeumatError(where, expected, f"{folder}: {error.strerror}") from error
    measured = [path for path in files if path.suffix.lower() in suffixes and not path.name.startswith(".")]
    names = [path.stem for path in measured]
    check_names(names, folder)
    if len(names) < 2:
        raise NeumatError(where, expected, ", ".join(names) or f"none in {folder}")
    return [*measured, *(path for path in files if path.suffix == ".h5" and path.stem in names)]


def inception_file(evaluate):
    """Return the file of Inception's weights that the config's section `evaluate` names, an empty list where none.

    Raises NeumatError where it is no file.
    """
    path = evaluate["inception"]
    if path is None:
        return []
    if not Path(path).is_file():
        raise NeumatError("config key evaluate.inception", "a file", path)
    return path


def expectation(schema):
    """Return in words what values `schema`, one key's, allows."""
    if "enum" in schema:
        return " or ".join(json.dumps(value) for value in schema["enum"])
    if "anyOf" in schema:
        return " or ".join(map(expectation, schema["anyOf"]))
    types = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    text = " or ".join(types)
    if "items" in schema:
        text += f" of {expectation(schema['items'])}"
        fewest, most = schema.get("minItems", 0), schema.get("maxItems")
        return text + (f", {fewest} of them" if fewest == most else f", at least {fewest}" if fewest else "")
    signs = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
    bounds = [f"{sign} {schema[key]}" for key, sign in signs.items() if key in schema]
    return " ".join([text, " and ".join(bounds)]).strip()


def keys(schema, prefix=""):
    """Yield (dotted key, its schema) for every key of `schema` that is not a section."""
    for name, child in schema["properties"].items():
        if "properties" in child:
            yield from keys(child, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", child


def table(schema):
    """Return the Markdown table of every key: what it means, its values, its default."""
    rows = ["| key | meaning | values | default |", "|---|---|---|---|"]
    for name, child in keys(schema):
        default = json.dumps(child["default"])
        rows.append(f"| `{name}` | {child['description']} | {expectation(child)} | `{default}` |")
    return "\n".join(rows) + "\n"


def _fill(config, schema):
    """Return a copy of `config` with the defaults of `schema` for absent keys; a section may be left empty.

    Keys come in the schema's order: Snakemake compares params in theirs, and would run a training anew because an
    overlay names a key first, if only with the value that it has.
    """
    if not isinstance(config, dict | None):
        return config
    if isinstance(schema.get("additionalProperties"), dict):  # sections whose names are free
        return {name: _fill(value, schema["additionalProperties"]) for name, value in (config or {}).items()}
    if "properties" not in schema:
        return config
    config = dict(config or {})
    for name, child in schema["properties"].items():
        if "properties" in child or isinstance(child.get("additionalProperties"), dict):
            config[name] = _fill(config.get(name), child)
        elif name not in config and "default" in child:
            config[name] = copy.deepcopy(child["default"])
    return {name: config[name] for name in (*schema["properties"], *config) if name in config}


def _one_line(error, what):
    """Return the NeumatError that says what `error` of jsonschema says, naming the key."""
    where = ".".join(str(part) for part in error.absolute_path)
    if error.validator == "additionalProperties":
        known = error.schema["properties"]
        unknown = sorted(str(name) for name in error.instance if name not in known)[0]
        key = f"{where}.{unknown}" if where else unknown
        return NeumatError(f"{what} key {key}", "one of " + ", ".join(known), "an unknown key")
    if error.validator == "required":
        missing = error.message.split("'")[1]
        return NeumatError(f"{what} key {where}".removesuffix(" key "), f"the key {missing}", "none")
    expected = "a section" if "properties" in error.schema else expectation(error.schema)
    return NeumatError(f"{what} key {where}", expected, repr(error.instance))


if __name__ == "__main__":
    print(table(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))), end="")
