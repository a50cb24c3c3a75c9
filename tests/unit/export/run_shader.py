"""Run an exported shader on whatever driver there is: run_shader.py SOURCE FUNCTION DIRECTIONS.npy RESULT.npy

DIRECTIONS: wi and wo, (n, 2, 4) float32, the last of each unused; RESULT: (n, 4) float32. The language is SOURCE's
suffix. Prints the name of the driver; exits with NO_DRIVER, and says why, where there is no package or no driver. A
program of its own, as Mesa and Mitsuba load different versions of LLVM.
"""

import contextlib
import sys
from pathlib import Path

import numpy as np

NO_DRIVER = 77
GROUP = 64


@contextlib.contextmanager
def no_driver():
    """Exit with NO_DRIVER where packages are missing or open no device; both raise what they like."""
    try:
        yield
    except Exception as error:
        print(f"{type(error).__name__}: {' '.join(str(error).split())}")
        sys.exit(NO_DRIVER)


def compile_glsl(context, source, function, version):
    """Compile the source in a fragment shader of another version of GLSL; moderngl raises where it does not."""
    modern = version not in ("100", "110")
    start = f"#version {version}\n" + ("precision highp float;\n" if version in ("100", "300 es") else "")
    given, passed, taken = ("in", "out", "in") if modern else ("attribute", "varying", "varying")
    color = "color" if modern else "gl_FragColor"
    context.program(
        vertex_shader=f"{start}{given} vec3 p; {passed} vec3 d; void main() {{ d = p; gl_Position = vec4(p, 1.0); }}",
        fragment_shader=f"{start}{taken} vec3 d; {'out vec4 color;' if modern else ''}\n{source}\n"
        f"void main() {{ {color} = vec4({function}(d, normalize(d)), 1.0); }}",
    )


def run_glsl(source, function, directions):
    """Return (result, name of the driver)."""
    with no_driver():
        import moderngl

        context = moderngl.create_context(require=430, standalone=True, backend="egl")
    program = f"""#version 430
layout(local_size_x = {GROUP}) in;
layout(std430, binding = 0) readonly buffer Directions {{ vec4 directions[]; }};
layout(std430, binding = 1) writeonly buffer Result {{ vec4 result[]; }};
{source}
void main() {{
    uint i = gl_GlobalInvocationID.x;
    result[i] = vec4({function}(directions[2u * i].xyz, directions[2u * i + 1u].xyz), 1.0);
}}"""
    for version in ("100", "110", "130", "300 es", "330"):
        compile_glsl(context, source, function, version)
    shader = context.compute_shader(program)
    result = context.buffer(reserve=16 * len(directions))
    context.buffer(directions.tobytes()).bind_to_storage_buffer(0)
    result.bind_to_storage_buffer(1)
    shader.run(len(directions) // GROUP)
    return np.frombuffer(result.read(), np.float32).reshape(-1, 4), context.info["GL_RENDERER"]


def run_wgsl(source, function, directions):
    """Return (result, name of the driver)."""
    with no_driver():
        import wgpu
        from wgpu.utils.compute import compute_with_buffers

        adapter = wgpu.gpu.request_adapter_sync()
    program = f"""
@group(0) @binding(0) var<storage, read> directions: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> result: array<vec4<f32>>;
{source}
@compute @workgroup_size({GROUP})
fn main(@builtin(global_invocation_id) id: vec3<u32>) {{
    let i = id.x;
    result[i] = vec4<f32>({function}(directions[2u * i].xyz, directions[2u * i + 1u].xyz), 1.0);
}}"""
    out = compute_with_buffers({0: directions}, {1: directions.nbytes // 2}, program, n=len(directions) // GROUP)
    return np.frombuffer(out[1], np.float32).reshape(-1, 4), adapter.info["device"]


def main(source, function, directions, result):
    run = {".glsl": run_glsl, ".wgsl": run_wgsl}[Path(source).suffix]
    directions = np.load(directions)
    padded = np.concatenate([directions, np.zeros((-len(directions) % GROUP, 2, 4), np.float32)])
    found, driver = run(Path(source).read_text(encoding="utf-8"), function, padded)
    np.save(result, found[: len(directions)])
    print(driver)


if __name__ == "__main__":
    main(*sys.argv[1:])
