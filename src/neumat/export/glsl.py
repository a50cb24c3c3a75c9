"""Fields as GLSL source: desktop from 1.10, ES and WebGL from 1.00; version and precision are the including file's."""

from neumat.export.shader import Language, write_source

GLSL = Language(
    signature="vec3 {name}(vec3 wi, vec3 wo)",
    number="float",
    vector="vec3",
    vector3="vec3",
    choose="({} ? {} : {})".format,
)


def write_glsl(path, weights, metadata):
    """Write the field (675,) as a function vec3 brdf_<name>(vec3 wi, vec3 wo)."""
    write_source(path, weights, metadata, GLSL)
