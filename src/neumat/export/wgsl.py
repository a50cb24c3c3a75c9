"""Fields as WGSL source, for WebGPU."""

from neumat.export.shader import Language, write_source

WGSL = Language(
    signature="fn {name}(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32>",
    number="let",
    vector="let",
    vector3="vec3<f32>",
    choose="select({2}, {1}, {0})".format,
)


def write_wgsl(path, weights, metadata):
    """Write the field (675,) as a function fn brdf_<name>(wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32>."""
    write_source(path, weights, metadata, WGSL)
